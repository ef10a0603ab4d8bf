//! The reports of the views, bounded: the latest with their pictures, earlier ones without, and of the earliest the number
//! only.

use super::state::pack;
use axum::body::Bytes;
use prost::Message;
use semascan_protocol::server_message::Body;
use semascan_protocol::{ServerMessage, ViewPage, ViewReport, ViewRequest};
use std::collections::BTreeMap;

/// Reports in a page: some hundred kilobytes with their pictures.
pub(super) const PAGE: usize = 64;
/// Bytes of reports with pictures that are kept: those of the latest thousands of views.
const PICTURED_BYTES: usize = 32 << 20;
/// Reports that are kept: some tens of megabytes.
const KEPT: usize = 100_000;

#[derive(Debug)]
struct Kept {
    place: u64,
    message: Bytes,
}

/// The reports by number and in the order of their coming.
#[derive(Debug)]
pub(super) struct ViewLog {
    latest: u64,
    by_number: BTreeMap<u32, Kept>,
    by_place: BTreeMap<u64, u32>,
    /// Bytes of the reports that have pictures, by their places.
    pictured: BTreeMap<u64, usize>,
    pictured_bytes: usize,
    forgotten: u32,
    most_pictured_bytes: usize,
    most: usize,
}

impl Default for ViewLog {
    fn default() -> Self {
        Self::bounded(PICTURED_BYTES, KEPT)
    }
}

impl ViewLog {
    fn bounded(most_pictured_bytes: usize, most: usize) -> Self {
        Self {
            latest: 0,
            by_number: BTreeMap::new(),
            by_place: BTreeMap::new(),
            pictured: BTreeMap::new(),
            pictured_bytes: 0,
            forgotten: 0,
            most_pictured_bytes,
            most,
        }
    }

    /// Keeps a report; it replaces an earlier one of the same view.
    pub(super) fn put(&mut self, report: ViewReport) {
        if let Some(old) = self.by_number.remove(&report.index) {
            self.leave(old.place);
        }
        self.latest += 1;
        let (place, number, has_pictures) = (self.latest, report.index, has_pictures(&report));
        let message = pack(Body::View(report));
        if has_pictures {
            self.pictured.insert(place, message.len());
            self.pictured_bytes += message.len();
        }
        self.by_place.insert(place, number);
        self.by_number.insert(number, Kept { place, message });
        while self.pictured_bytes > self.most_pictured_bytes {
            let Some((place, bytes)) = self.pictured.pop_first() else { break };
            self.pictured_bytes -= bytes;
            let report = self.by_place.get(&place).and_then(|number| self.by_number.get_mut(number));
            if let Some(report) = report {
                report.message = without_pictures(&report.message);
            }
        }
        if self.by_number.len() > self.most
            && let Some((_, oldest)) = self.by_number.pop_first()
        {
            self.leave(oldest.place);
            self.forgotten += 1;
        }
    }

    fn leave(&mut self, place: u64) {
        self.by_place.remove(&place);
        self.pictured_bytes -= self.pictured.remove(&place).unwrap_or(0);
    }

    /// Place of the latest report.
    pub(super) fn latest(&self) -> u64 {
        self.latest
    }

    /// Whether one that was sent the reports up to `place` is better sent the latest page than all since.
    pub(super) fn is_far_behind(&self, place: u64) -> bool {
        self.latest - place.min(self.latest) > PAGE as u64
    }

    /// The next report after place `place`, and its place.
    pub(super) fn after(&self, place: u64) -> Option<(u64, Bytes)> {
        let (place, number) = self.by_place.range(place + 1..).next()?;
        Some((*place, self.by_number.get(number)?.message.clone()))
    }

    /// The reports that `request` asks for, oldest first.
    pub(super) fn page(&self, request: &ViewRequest) -> (ViewPage, Vec<Bytes>) {
        let count = if request.count == 0 { PAGE } else { PAGE.min(request.count as usize) };
        let before = match request.before {
            0 => self.by_number.range(..),
            number => self.by_number.range(..number),
        };
        let latest_first = before.rev().take(count);
        let mut reports: Vec<(u32, Bytes)> =
            latest_first.map(|(number, kept)| (*number, kept.message.clone())).collect();
        reports.reverse();
        let first = reports.first().map_or(0, |(number, _)| *number);
        let page = ViewPage {
            count: reports.len() as u32,
            kept: self.by_number.len() as u32,
            forgotten: self.forgotten,
            first,
            earlier: !reports.is_empty() && self.by_number.range(..first).next().is_some(),
        };
        (page, reports.into_iter().map(|(_, message)| message).collect())
    }
}

fn has_pictures(report: &ViewReport) -> bool {
    let pictures = [&report.thumbnail_jpeg, &report.overlay_png, &report.sigma_png, &report.contribution_png];
    pictures.iter().any(|picture| !picture.is_empty())
}

/// The message of a report, with its pictures left out and that said.
fn without_pictures(message: &Bytes) -> Bytes {
    match ServerMessage::decode(message.clone()).ok().and_then(|m| m.body) {
        Some(Body::View(report)) => pack(Body::View(ViewReport {
            thumbnail_jpeg: Vec::new(),
            overlay_png: Vec::new(),
            sigma_png: Vec::new(),
            contribution_png: Vec::new(),
            pictures_dropped: true,
            ..report
        })),
        // It was packed here: there is no other case.
        _ => message.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(index: u32, picture: usize) -> ViewReport {
        ViewReport { index, thumbnail_jpeg: vec![1; picture], ..ViewReport::default() }
    }

    fn decoded(messages: &[Bytes]) -> Vec<ViewReport> {
        let report = |m: &Bytes| match ServerMessage::decode(m.clone()).expect("valid").body {
            Some(Body::View(report)) => report,
            other => panic!("a report was due: {other:?}"),
        };
        messages.iter().map(report).collect()
    }

    #[test]
    fn pages_lead_back_to_the_first_view_and_miss_none() {
        let mut log = ViewLog::default();
        (0..5000).for_each(|index| log.put(report(index, 10)));
        let (mut request, mut seen) = (ViewRequest::default(), Vec::new());
        loop {
            let (page, reports) = log.page(&request);
            let reports = decoded(&reports);
            assert_eq!((page.count as usize, page.kept, page.forgotten), (reports.len(), 5000, 0));
            assert!(reports.len() <= PAGE && reports.is_sorted_by_key(|r| r.index));
            seen.splice(0..0, reports.iter().map(|r| r.index));
            if !page.earlier {
                break;
            }
            request.before = page.first;
        }
        assert_eq!(seen, (0..5000).collect::<Vec<_>>());
        let few = log.page(&ViewRequest { before: 100, count: 3 });
        assert_eq!(decoded(&few.1).iter().map(|r| r.index).collect::<Vec<_>>(), [97, 98, 99]);
        let (none, reports) = ViewLog::default().page(&ViewRequest::default());
        assert!(reports.is_empty() && !none.earlier);
    }

    #[test]
    fn memory_is_bounded_and_what_is_missing_is_said() {
        let mut log = ViewLog::bounded(100_000, 2000);
        (0..3000).for_each(|index| log.put(report(index, 1000)));
        let bytes: usize = log.by_number.values().map(|k| k.message.len()).sum();
        assert!(bytes < 120_000, "{bytes}");
        let (page, latest) = log.page(&ViewRequest::default());
        assert_eq!((page.kept, page.forgotten), (2000, 1000));
        assert!(decoded(&latest).iter().all(|r| r.thumbnail_jpeg.len() == 1000 && !r.pictures_dropped));
        let (page, earliest) = log.page(&ViewRequest { before: 1010, count: 0 });
        assert_eq!((page.first, page.count, page.earlier), (1000, 10, false));
        assert!(decoded(&earliest).iter().all(|r| r.thumbnail_jpeg.is_empty() && r.pictures_dropped));
    }

    #[test]
    fn a_second_report_of_a_view_replaces_the_first_and_comes_last() {
        let mut log = ViewLog::default();
        (0..2).for_each(|index| log.put(report(index, 5)));
        log.put(report(0, 7));
        let (place, first) = log.after(0).expect("view 1");
        let (place, second) = log.after(place).expect("view 0 again");
        assert_eq!(log.after(place), None);
        let reports = decoded(&[first, second]);
        assert_eq!(
            [(reports[0].index, 5), (reports[1].index, 7)],
            [(1, reports[0].thumbnail_jpeg.len()), (0, reports[1].thumbnail_jpeg.len())]
        );
        assert!(!log.is_far_behind(place) && !log.is_far_behind(place + 100));
    }
}
