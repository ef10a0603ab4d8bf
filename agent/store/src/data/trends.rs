//! What inspections come to day by day, counted in SQLite.

use super::catalogue::{SqliteCatalogue, conditions};
use rusqlite::params_from_iter;
use semascan_inspection::ports::{ClassTrend, DayTrend, InspectionFilter, PortError, Trends};

/// The inspections that a filter fits; its limit holds for them.
const FITTING: &str = "FROM inspections JOIN parts ON parts.id = inspections.part";

impl SqliteCatalogue {
    /// See [`Catalogue::trends`](semascan_inspection::ports::Catalogue::trends).
    pub(super) fn count_trends(&self, filter: &InspectionFilter) -> Result<Trends, PortError> {
        let (conditions, values) = conditions(filter);
        let fitting = format!("{FITTING} {conditions} ORDER BY inspections.id DESC LIMIT {}", filter.limit);
        let connection = self.connection();
        let days = format!(
            "SELECT substr(began, 1, 10) AS day, count(*), count(findings), coalesce(sum(findings), 0), \
             count(*) FILTER (WHERE decision = 'accept'), count(*) FILTER (WHERE decision = 'rework'), \
             count(*) FILTER (WHERE decision = 'reject'), count(*) FILTER (WHERE decision = 'person'), avg(confidence) \
             FROM (SELECT began, findings, decision, confidence {fitting}) GROUP BY day ORDER BY day"
        );
        let mut select = connection.prepare(&days).map_err(self.error())?;
        let rows = select.query_map(params_from_iter(&values), |row| {
            Ok(DayTrend {
                day: row.get(0)?,
                inspections: row.get(1)?,
                looked: row.get(2)?,
                findings: row.get(3)?,
                accept: row.get(4)?,
                rework: row.get(5)?,
                reject: row.get(6)?,
                person: row.get(7)?,
                confidence: row.get(8)?,
            })
        });
        let days = rows.and_then(Iterator::collect).map_err(self.error())?;
        let classes = format!(
            "SELECT component, defect, kind, count(*), count(DISTINCT inspection), sum(area), count(*) - count(area) \
             FROM findings WHERE inspection IN (SELECT inspections.id {fitting}) \
             GROUP BY component, defect, kind ORDER BY count(DISTINCT inspection) DESC, count(*) DESC, component, defect"
        );
        let mut select = connection.prepare(&classes).map_err(self.error())?;
        let rows = select.query_map(params_from_iter(&values), |row| {
            Ok(ClassTrend {
                component: row.get(0)?,
                defect: row.get(1)?,
                kind: row.get(2)?,
                findings: row.get(3)?,
                inspections: row.get(4)?,
                area: row.get(5)?,
                without_area: row.get(6)?,
            })
        });
        let classes = rows.and_then(Iterator::collect).map_err(self.error())?;
        Ok(Trends { days, classes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::Timestamp;
    use semascan_inspection::ports::{Catalogue, FindingRow, InspectionRow, InspectionState, ResultRow, ResultRows};
    use semascan_model::InspectionId;
    use semascan_model::verdict::Decision;

    const DAY: u64 = 86_400_000;

    fn noted(catalogue: &SqliteCatalogue, millis: u64, decision: Option<Decision>, findings: Option<&[(&str, f64)]>) {
        let id = InspectionId::new(millis, &[7; 10]);
        let began = Timestamp::from_millisecond(millis as i64).expect("in range");
        let row = InspectionRow {
            id,
            part: "motor".into(),
            source: "s".into(),
            spec: "{}".into(),
            began,
            ended: None,
            state: InspectionState::Running,
            reason: None,
            held: false,
            views: 0,
            result: ResultRow::default(),
        };
        catalogue.begin(&row).expect("begun");
        let list = findings.unwrap_or_default().iter().enumerate().map(|(number, (defect, area))| FindingRow {
            id: format!("{millis}-{number}"),
            kind: "defect",
            component: "gear".into(),
            defect: Some((*defect).into()),
            area: (*area > 0.0).then_some(*area),
        });
        // Nobody looked: nothing is labelled.
        let confidence = findings.map(|findings| 1.0 - 0.1 * findings.len() as f64);
        let findings = findings.map(|findings| findings.len() as u32);
        let result = ResultRow { decision, automatic: decision, conflicts: 0, findings };
        catalogue.set_result(id, &ResultRows { row: result, findings: list.collect(), confidence }).expect("noted");
    }

    #[test]
    fn days_and_classes_are_counted_and_what_nobody_looked_for_is_no_absence() {
        let root = tempfile::tempdir().expect("a folder");
        let catalogue = SqliteCatalogue::open(&root.path().join("semascan.db")).expect("opens");
        noted(&catalogue, 10 * DAY, Some(Decision::Accept), Some(&[]));
        noted(&catalogue, 10 * DAY + 1000, Some(Decision::Rework), Some(&[("wear", 1e-4), ("wear", 2e-4)]));
        noted(&catalogue, 12 * DAY, None, None);
        noted(&catalogue, 12 * DAY + 1000, Some(Decision::Reject), Some(&[("wear", 0.0), ("crack", 1e-5)]));
        let trends = catalogue.trends(&InspectionFilter::default()).expect("counted");
        let days: Vec<_> = trends.days.iter().map(|d| (d.day.as_str(), d.inspections, d.looked, d.findings)).collect();
        assert_eq!(days, [("1970-01-11", 2, 2, 2), ("1970-01-13", 2, 1, 2)]);
        let first = &trends.days[0];
        assert_eq!((first.accept, first.rework, first.reject, first.person), (1, 1, 0, 0));
        let confidence: Vec<_> =
            trends.days.iter().map(|day| day.confidence.map(|c| (c * 1e6).round() / 1e6)).collect();
        assert_eq!(confidence, [Some(0.9), Some(0.8)], "of those of which it is known");
        let wear = &trends.classes[0];
        assert_eq!((wear.defect.as_deref(), wear.findings, wear.inspections), (Some("wear"), 3, 2));
        assert!(wear.area.is_some_and(|area| (area - 3e-4).abs() < 1e-12) && wear.without_area == 1);
        assert_eq!(trends.classes[1].defect.as_deref(), Some("crack"));
        // Of those that a filter fits, and no more than are asked for.
        let filter = InspectionFilter { decision: Some(Decision::Rework), ..InspectionFilter::default() };
        let rework = catalogue.trends(&filter).expect("counted");
        assert_eq!((rework.days.len(), rework.classes.len(), rework.classes[0].findings), (1, 1, 2));
        let latest = catalogue.trends(&InspectionFilter { limit: 1, ..InspectionFilter::default() }).expect("counted");
        assert_eq!((latest.days.len(), latest.days[0].reject), (1, 1));
        let none = InspectionFilter { part: Some("pump".into()), ..InspectionFilter::default() };
        assert_eq!(catalogue.trends(&none), Ok(Trends::default()));
    }
}
