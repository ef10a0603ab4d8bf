//! `/inspections/{inspection}/views`: what became of each view, and its pictures in full size.
//!
//! Colour is a PNG of 8 bits, depth one of 16 bits with its unit in a header and in the file, labels one of 16 bits that holds
//! class numbers, sigma one of 8 bits where 255 is 1. What the inspection did not say of a pixel is not made up: where there
//! are no labels, or no uncertainty was estimated, there is no picture.

use super::super::server::Shared;
use super::answer;
use super::openapi::{classes, instances_too, long_limits, numbers};
use super::problem::Problem;
use super::request::{blocking, inspection_id, limit, parsed, view_number};
use crate::past::Past;
use axum::extract::rejection::QueryRejection;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode};
use axum::response::Response;
use png::{BitDepth, ColorType, Compression, Encoder};
use schemars::JsonSchema;
use semascan_inspection::ports::{InspectionState, PixelLabels};
use semascan_model::InspectionId;
use semascan_model::record::ViewRecord;
use semascan_perception::view::{DepthImage, View};
use serde::{Deserialize, Serialize};
use utoipa::IntoParams;

/// Views of a page where the client does not say it, and most.
const PAGE: (u32, u32) = (100, 500);
/// The header, and the text in the file, that say how many metres a step of the depth picture is.
const DEPTH_UNIT: &str = "depth-unit-metres";
/// Metres of a step; the finest is taken in which every depth can be said.
const STEPS: [f32; 4] = [1e-4, 1e-3, 1e-2, 1e-1];

/// A page of views.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct ViewsQuery {
    /// `next` of the page before: the first view.
    #[param(schema_with = numbers)]
    cursor: Option<String>,
    /// Most of a page, 1 to 500.
    #[param(schema_with = long_limits)]
    limit: Option<String>,
}

/// Which labels are asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct LabelsQuery {
    /// Of what: `components` (default), `defects` or `instances`.
    #[param(schema_with = instances_too)]
    of: Option<String>,
}

/// Of which labels the uncertainty is asked for.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct SigmaQuery {
    /// Of what: `components` (default) or `defects`.
    #[param(schema_with = classes)]
    of: Option<String>,
}

/// Views in capture order.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ViewList {
    /// What became of each. After the end of the inspection with their refined poses.
    items: Vec<ViewRecord>,
    /// The `cursor` of the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    next: Option<u32>,
}

/// The views of an inspection, in capture order.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/views",
    tag = "views",
    params(("inspection" = String, Path, description = "The inspection"), ViewsQuery),
    responses((status = 200, description = "A page", body = ref("#/components/schemas/ViewList")))
)]
pub(super) async fn list(
    State(shared): State<Shared>,
    Path(id): Path<String>,
    headers: HeaderMap,
    query: Result<Query<ViewsQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let id = inspection_id(&id)?;
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let first: u32 = parsed("cursor", query.cursor.as_deref())?.unwrap_or(0);
    let page = limit(query.limit.as_deref(), PAGE.0, PAGE.1)? as usize;
    blocking(&shared, move |past| {
        let mut views: Vec<ViewRecord> = views(past, id)?.into_iter().filter(|view| view.index >= first).collect();
        let next = views.get(page).map(|view| view.index);
        views.truncate(page);
        answer::json(&headers, &ViewList { items: views, next })
    })
    .await
}

fn views(past: &Past, id: InspectionId) -> Result<Vec<ViewRecord>, Problem> {
    let row = past.row(id)?;
    if row.state != InspectionState::Running
        && let Some(record) = past.archive.record(id)?
        && !record.views.is_empty()
    {
        return Ok(record.views);
    }
    let rows = past.catalogue.views(id)?.into_iter();
    let records = rows.map(|view| {
        serde_json::from_str(&view.record).map_err(|error| {
            tracing::error!("the record of view {} of inspection {id} cannot be read: {error}", view.index);
            Problem::new(StatusCode::SERVICE_UNAVAILABLE, format!("the record of view {} is damaged", view.index))
        })
    });
    records.collect()
}

/// The colour picture: PNG, 8 bits, red, green, blue.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/views/{view}/color.png",
    tag = "views",
    params(
        ("inspection" = String, Path, description = "The inspection"),
        ("view" = u32, Path, description = "Number of the view in the capture order")
    ),
    responses((status = 200, description = "The picture", content_type = "image/png", body = [u8]))
)]
pub(super) async fn color(
    State(shared): State<Shared>,
    Path((id, view)): Path<(String, String)>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    picture(&shared, &id, &view, headers, |view, _| {
        let (width, height) = view.rgb.dimensions();
        Ok((png(width, height, ColorType::Rgb, BitDepth::Eight, view.rgb.as_raw(), None)?, None))
    })
    .await
}

/// The depth picture: PNG, 16 bits, 0 where nothing was measured. The header `depth-unit-metres` and a text of that name in the
/// file say how many metres a step is.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/views/{view}/depth.png",
    tag = "views",
    params(
        ("inspection" = String, Path, description = "The inspection"),
        ("view" = u32, Path, description = "Number of the view in the capture order")
    ),
    responses((
        status = 200, description = "The picture", content_type = "image/png", body = [u8],
        headers(("depth-unit-metres" = f64, description = "Metres of a step"))
    ))
)]
pub(super) async fn depth(
    State(shared): State<Shared>,
    Path((id, view)): Path<(String, String)>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    picture(&shared, &id, &view, headers, |view, _| {
        let (step, steps) = steps(&view.depth)?;
        let DepthImage { width, height, .. } = *view.depth;
        let unit = step.to_string();
        Ok((png(width, height, ColorType::Grayscale, BitDepth::Sixteen, &sixteen(&steps), Some(&unit))?, Some(unit)))
    })
    .await
}

/// Labels: PNG, 16 bits, the number of the class or instance of each pixel.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/views/{view}/labels.png",
    tag = "views",
    params(
        ("inspection" = String, Path, description = "The inspection"),
        ("view" = u32, Path, description = "Number of the view in the capture order"),
        LabelsQuery
    ),
    responses((status = 200, description = "The picture", content_type = "image/png", body = [u8]))
)]
pub(super) async fn labels(
    State(shared): State<Shared>,
    Path((id, view)): Path<(String, String)>,
    headers: HeaderMap,
    query: Result<Query<LabelsQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let choose: fn(&PixelLabels) -> &[u16] = match query.of.as_deref() {
        None | Some("components") => |labels| &labels.components,
        Some("defects") => |labels| &labels.defects,
        Some("instances") => |labels| &labels.instances,
        Some(other) => return Err(Problem::parameter("of", other, "is none of components, defects, instances")),
    };
    picture(&shared, &id, &view, headers, move |_, labels| {
        let labels = labels.ok_or_else(without_labels)?;
        let (width, height) = (labels.width, labels.height);
        Ok((png(width, height, ColorType::Grayscale, BitDepth::Sixteen, &sixteen(choose(labels)), None)?, None))
    })
    .await
}

/// Standard uncertainty of the labels: PNG, 8 bits, 255 = 1.
#[utoipa::path(
    get,
    path = "/api/v1/inspections/{inspection}/views/{view}/sigma.png",
    tag = "views",
    params(
        ("inspection" = String, Path, description = "The inspection"),
        ("view" = u32, Path, description = "Number of the view in the capture order"),
        SigmaQuery
    ),
    responses((status = 200, description = "The picture", content_type = "image/png", body = [u8]))
)]
pub(super) async fn sigma(
    State(shared): State<Shared>,
    Path((id, view)): Path<(String, String)>,
    headers: HeaderMap,
    query: Result<Query<SigmaQuery>, QueryRejection>,
) -> Result<Response, Problem> {
    let Query(query) = query.map_err(|rejection| Problem::of_query(&rejection))?;
    let choose: fn(&PixelLabels) -> &Option<Vec<u8>> = match query.of.as_deref() {
        None | Some("components") => |labels| &labels.component_sigma,
        Some("defects") => |labels| &labels.defect_sigma,
        Some(other) => return Err(Problem::parameter("of", other, "is none of components, defects")),
    };
    picture(&shared, &id, &view, headers, move |_, labels| {
        let labels = labels.ok_or_else(without_labels)?;
        let sigma = choose(labels).as_ref().ok_or_else(|| {
            Problem::not_found(
                "no uncertainty was estimated: the labels came with the view, or there is no network for them",
            )
        })?;
        Ok((png(labels.width, labels.height, ColorType::Grayscale, BitDepth::Eight, sigma, None)?, None))
    })
    .await
}

fn without_labels() -> Problem {
    Problem::not_found("the view has no labels: it did not come so far, or was inspected without")
}

/// A picture of a captured view, and the unit of its values where it has one.
type Drawn = (Vec<u8>, Option<String>);

/// Answers with what `draw` makes of a view and its labels.
async fn picture(
    shared: &Shared,
    id: &str,
    view: &str,
    headers: HeaderMap,
    draw: impl FnOnce(&View, Option<&PixelLabels>) -> Result<Drawn, Problem> + Send + 'static,
) -> Result<Response, Problem> {
    let (id, index) = (inspection_id(id)?, view_number(view)?);
    blocking(shared, move |past| {
        past.row(id)?;
        let found = past.archive.view(id, index)?;
        let found = found.ok_or_else(|| Problem::not_found(format!("inspection {id} has no captured view {index}")))?;
        let view = found
            .view
            .map_err(|reason| Problem::not_found(format!("the source could not give view {index}: {reason}")))?;
        let (png, unit) = draw(&view, found.labels.as_ref())?;
        let mut response = answer::bytes(&headers, "image/png", png);
        if let Some(unit) = unit.and_then(|unit| HeaderValue::from_str(&unit).ok()) {
            response.headers_mut().insert(HeaderName::from_static(DEPTH_UNIT), unit);
        }
        Ok(response)
    })
    .await
}

/// Depths as steps, and how many metres a step is: none is cut off at the end of 16 bits.
fn steps(depth: &DepthImage) -> Result<(f32, Vec<u16>), Problem> {
    let farthest = depth.metres.iter().copied().fold(0.0, f32::max);
    let step = STEPS
        .into_iter()
        .find(|step| (farthest / step).round() <= f32::from(u16::MAX))
        .ok_or_else(|| Problem::not_found(format!("a depth of {farthest} m cannot be said in 16 bits")))?;
    // What was measured must not become 0, which says that nothing was.
    let stepped = |z: &f32| if *z > 0.0 { (z / step).round().max(1.0) as u16 } else { 0 };
    Ok((step, depth.metres.iter().map(stepped).collect()))
}

/// Values of 16 bits as PNG has them: the high byte first.
fn sixteen(values: &[u16]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

fn png(
    width: u32,
    height: u32,
    color: ColorType,
    depth: BitDepth,
    data: &[u8],
    unit: Option<&str>,
) -> Result<Vec<u8>, Problem> {
    let failed = |error: png::EncodingError| {
        Problem::new(StatusCode::INTERNAL_SERVER_ERROR, format!("the picture cannot be written: {error}"))
    };
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(Compression::Fast);
    if let Some(unit) = unit {
        encoder.add_text_chunk(DEPTH_UNIT.to_owned(), unit.to_owned()).map_err(failed)?;
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(data).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_depth_is_cut_off_and_none_becomes_unmeasured() {
        let of = |metres: &[f32]| {
            let image = DepthImage { width: metres.len() as u32, height: 1, metres: metres.to_vec() };
            steps(&image)
        };
        assert_eq!(of(&[0.0, 0.4321, 6.5535, 1e-6]).expect("fits"), (1e-4, vec![0, 4321, 65_535, 1]));
        assert_eq!(of(&[6.5536, 0.4321]).expect("fits"), (1e-3, vec![6554, 432]));
        assert_eq!(of(&[100.0]).expect("fits"), (1e-2, vec![10_000]));
        assert!(of(&[1e6]).is_err());
        assert_eq!(of(&[]).expect("fits"), (1e-4, vec![]));
    }

    #[test]
    fn a_picture_of_16_bits_comes_back_with_its_unit() {
        let bytes =
            png(2, 1, ColorType::Grayscale, BitDepth::Sixteen, &sixteen(&[0x1234, 7]), Some("0.0001")).expect("a PNG");
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a PNG");
        let mut pixels = [0; 4];
        reader.next_frame(&mut pixels).expect("pixels");
        assert_eq!(pixels, [0x12, 0x34, 0, 7]);
        let text = &reader.info().uncompressed_latin1_text[0];
        assert_eq!((text.keyword.as_str(), text.text.as_str()), (DEPTH_UNIT, "0.0001"));
    }
}
