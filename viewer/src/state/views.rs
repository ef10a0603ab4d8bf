//! The captured views, as the agent reported them.

use crate::words::t;
use semascan_protocol::{Domain, Intrinsics, Pose, ViewPage, ViewReport};
use std::sync::Arc;

/// Characters of a view's reason that are kept.
const MOST_REASON: usize = 1000;

/// One captured view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewEntry {
    /// Its number, from 0.
    pub index: u32,
    /// Whether it became part of the model.
    pub accepted: bool,
    /// Why it was rejected.
    pub reason: String,
    /// Where the camera stood, `table_from_camera`; absent if that is not known.
    pub pose: Option<Pose>,
    /// The camera.
    pub intrinsics: Option<Intrinsics>,
    /// How sharp the picture is against others of the part, 0 to 1; absent if that is not known.
    pub sharpness: Option<f32>,
    /// The picture, JPEG; empty if there is none.
    pub thumbnail_jpeg: Arc<[u8]>,
    /// Class colours over the picture, PNG; may be empty.
    pub overlay_png: Arc<[u8]>,
    /// Uncertainty of the labels over the picture, PNG; may be empty.
    pub sigma_png: Arc<[u8]>,
    /// Share of colour against depth over the picture, PNG; may be empty.
    pub contribution_png: Arc<[u8]>,
    /// Voxels that this view made.
    pub points_added: u64,
    /// Whether the networks were trained for such views.
    pub domain: Domain,
    /// Whether the agent has dropped its pictures: it keeps those of the latest views.
    pub pictures_dropped: bool,
}

/// What can be laid over a view's picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ViewOverlay {
    /// The picture alone.
    None,
    /// Component classes.
    #[default]
    Labels,
    /// Uncertainty of the classes.
    Sigma,
    /// Where a two-stream network went by colour, and where by depth (P2).
    Contribution,
}

impl ViewOverlay {
    /// All, in the order of the panel.
    pub const ALL: [Self; 4] = [Self::None, Self::Labels, Self::Sigma, Self::Contribution];

    /// Stable name for tests.
    pub fn key(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Labels => "labels",
            Self::Sigma => "sigma",
            Self::Contribution => "contribution",
        }
    }

    /// Name for people.
    pub fn label(self) -> &'static str {
        match self {
            Self::None => t!("views.overlay.none"),
            Self::Labels => t!("views.overlay.labels"),
            Self::Sigma => t!("views.overlay.sigma"),
            Self::Contribution => t!("views.overlay.contribution"),
        }
    }
}

impl ViewEntry {
    /// The picture of an overlay, PNG; `None` if the view has none.
    pub fn overlay(&self, kind: ViewOverlay) -> Option<&[u8]> {
        let png = match kind {
            ViewOverlay::None => return None,
            ViewOverlay::Labels => &self.overlay_png,
            ViewOverlay::Sigma => &self.sigma_png,
            ViewOverlay::Contribution => &self.contribution_png,
        };
        (!png.is_empty()).then_some(&**png)
    }
}

impl From<&ViewReport> for ViewEntry {
    fn from(report: &ViewReport) -> Self {
        Self {
            index: report.index,
            accepted: report.accepted,
            reason: report.reason.chars().take(MOST_REASON).collect(),
            pose: report.table_from_camera,
            intrinsics: report.intrinsics,
            sharpness: report.sharpness.filter(|s| s.is_finite() && *s >= 0.0),
            thumbnail_jpeg: report.thumbnail_jpeg.as_slice().into(),
            overlay_png: report.overlay_png.as_slice().into(),
            sigma_png: report.sigma_png.as_slice().into(),
            contribution_png: report.contribution_png.as_slice().into(),
            points_added: report.points_added,
            domain: report.domain(),
            pictures_dropped: report.pictures_dropped,
        }
    }
}

impl ViewEntry {
    /// Bytes of its pictures.
    fn picture_bytes(&self) -> usize {
        [&self.thumbnail_jpeg, &self.overlay_png, &self.sigma_png, &self.contribution_png].map(|p| p.len()).iter().sum()
    }

    /// Keeps what is known of it and lets its pictures go.
    fn drop_pictures(&mut self) {
        let none: Arc<[u8]> = Arc::default();
        for picture in
            [&mut self.thumbnail_jpeg, &mut self.overlay_png, &mut self.sigma_png, &mut self.contribution_png]
        {
            *picture = none.clone();
        }
        self.pictures_dropped = true;
    }
}

/// The captured views in the order of their numbers, the latest [`Views::MAX`] of them at most, with pictures of
/// [`Views::MAX_PICTURE_BYTES`]. The agent sends the latest by
/// itself, and earlier ones as they are asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Views {
    list: Vec<ViewEntry>,
    selected: Option<u32>,
    latest: Option<u32>,
    earlier: bool,
}

impl Views {
    /// Most views that are kept for display.
    pub const MAX: usize = 1000;

    /// Most bytes of pictures that are kept: those of the latest views.
    pub const MAX_PICTURE_BYTES: usize = 128 << 20;

    /// Bytes of the pictures that are kept.
    pub fn picture_bytes(&self) -> usize {
        self.list.iter().map(ViewEntry::picture_bytes).sum()
    }

    /// The number before which more views can be asked for; `None` if the agent has none, or no more are kept here.
    pub fn earlier(&self) -> Option<u32> {
        let room = self.list.len() + Self::PAGE <= Self::MAX;
        self.list.first().map(|v| v.index).filter(|_| self.earlier && room)
    }

    /// Whether there are views before the first that is kept.
    pub fn is_cut(&self) -> bool {
        self.earlier
    }

    /// Room that a page of earlier views may take.
    const PAGE: usize = 64;

    /// Takes notice of the reports that follow.
    pub(super) fn page(&mut self, page: &ViewPage) {
        let (first, last) = (self.list.first().map(|v| v.index), self.list.last().map(|v| v.index));
        if page.count > 0 && last.is_some_and(|last| page.first > last.saturating_add(1)) {
            // Between what is kept and what comes some are missing: it begins anew, so that none seems not to exist.
            *self = Self { earlier: page.earlier, ..Self::default() };
        } else if page.count == 0 || first.is_none_or(|first| page.first < first) {
            self.earlier = page.earlier;
        }
    }

    /// The views in order.
    pub fn iter(&self) -> std::slice::Iter<'_, ViewEntry> {
        self.list.iter()
    }

    /// The view of that number.
    pub fn get(&self, index: u32) -> Option<&ViewEntry> {
        self.list.binary_search_by_key(&index, |v| v.index).ok().map(|i| &self.list[i])
    }

    /// The view the person selected.
    pub fn selected(&self) -> Option<&ViewEntry> {
        self.selected.and_then(|index| self.get(index))
    }

    /// The view whose camera is drawn: the selected one, else the latest report that has a pose.
    pub fn shown_camera(&self) -> Option<&ViewEntry> {
        match self.selected() {
            Some(view) => Some(view).filter(|v| v.pose.is_some()),
            None => self.latest.and_then(|index| self.get(index)),
        }
    }

    /// Takes a report; a second report of a view replaces the first.
    pub(super) fn report(&mut self, report: &ViewReport) {
        let entry = ViewEntry::from(report);
        if entry.pose.is_some() {
            self.latest = Some(entry.index);
        }
        match self.list.binary_search_by_key(&entry.index, |v| v.index) {
            Ok(i) => self.list[i] = entry,
            Err(i) => self.list.insert(i, entry),
        }
        if self.list.len() > Self::MAX {
            let gone = self.list.remove(0).index;
            self.earlier = true;
            self.selected = self.selected.filter(|s| *s != gone);
            self.latest = self.latest.filter(|l| *l != gone);
        }
        let mut bytes = self.picture_bytes();
        for view in &mut self.list {
            if bytes <= Self::MAX_PICTURE_BYTES {
                break;
            }
            bytes -= view.picture_bytes();
            view.drop_pictures();
        }
    }

    /// Selects a view, or none; the number of a view that is not there selects none.
    pub(super) fn select(&mut self, index: Option<u32>) {
        self.selected = index.filter(|i| self.get(*i).is_some());
    }

    /// Selects the view `step` places further, stopping at both ends; from the last one if none is selected.
    pub(super) fn step(&mut self, step: i32) {
        let Some(last) = self.list.len().checked_sub(1) else {
            return;
        };
        let here = self.selected.and_then(|s| self.list.binary_search_by_key(&s, |v| v.index).ok());
        let there = match here {
            Some(i) => i.saturating_add_signed(step as isize).min(last),
            None => last,
        };
        self.selected = Some(self.list[there].index);
    }
}
