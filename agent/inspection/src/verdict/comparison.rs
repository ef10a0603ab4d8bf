//! A figure with its interval against a limit ([ISO 14253-1]).

use semascan_model::finding::{FindingId, NamedClass, Quantity};
use semascan_model::verdict::{Conformity, Decision, JudgedFigure, VerdictLine};

/// Several figures against one limit.
pub(super) struct Compared {
    pub(super) conformity: Conformity,
    /// The figure that is nearest to breaking the limit, or farthest beyond; `None` without any, and where one is not known.
    pub(super) value: Option<Quantity>,
    /// The findings whose figures do not hold; all of them where all hold.
    pub(super) findings: Vec<FindingId>,
}

impl Compared {
    pub(super) fn at_most(values: &[(FindingId, Option<Quantity>)], limit: f64) -> Self {
        Self::new(values, |v| at_most(v, limit), |a, b| a.value.total_cmp(&b.value))
    }

    pub(super) fn at_least(values: &[(FindingId, Option<Quantity>)], limit: f64) -> Self {
        Self::new(values, |v| at_least(v, limit), |a, b| b.value.total_cmp(&a.value))
    }

    fn new(
        values: &[(FindingId, Option<Quantity>)],
        compare: impl Fn(Quantity) -> Conformity,
        order: impl Fn(&Quantity, &Quantity) -> std::cmp::Ordering,
    ) -> Self {
        let judged: Vec<(FindingId, Option<Quantity>, Conformity)> =
            values.iter().map(|(id, v)| (*id, *v, v.map_or(Conformity::Undecided, &compare))).collect();
        let any = |wanted: Conformity| judged.iter().any(|(.., c)| *c == wanted);
        let conformity = [Conformity::Broken, Conformity::Undecided]
            .into_iter()
            .find(|wanted| any(*wanted))
            .unwrap_or(Conformity::Holds);
        let of = || judged.iter().filter(|(.., c)| *c == conformity);
        // Where a figure is not known it is what the line is about, and not another finding's.
        let unknown = conformity == Conformity::Undecided && of().any(|(_, v, _)| v.is_none());
        let value = if unknown { None } else { of().filter_map(|(_, v, _)| *v).max_by(order) };
        Self { conformity, value, findings: of().map(|(id, ..)| *id).collect() }
    }

    /// What holds may not hold: there may be more than was measured.
    pub(super) fn doubt(&mut self, doubtful: bool) {
        if doubtful && self.conformity == Conformity::Holds {
            self.conformity = Conformity::Undecided;
        }
    }

    pub(super) fn line(self, line: VerdictLine, then: Decision, limit: f64, reason: &str) -> VerdictLine {
        let Self { conformity, value, findings } = self;
        let decision = follows(conformity, then);
        VerdictLine { findings, value, limit: Some(limit), conformity, decision, reason: reason.into(), ..line }
    }
}

pub(super) fn at_most(value: Quantity, limit: f64) -> Conformity {
    match value.interval() {
        Some((_, high)) if high <= limit => Conformity::Holds,
        Some((low, _)) if low > limit => Conformity::Broken,
        _ => Conformity::Undecided,
    }
}

pub(super) fn at_least(value: Quantity, limit: f64) -> Conformity {
    match value.interval() {
        Some((low, _)) if low >= limit => Conformity::Holds,
        Some((_, high)) if high < limit => Conformity::Broken,
        _ => Conformity::Undecided,
    }
}

pub(super) fn follows(conformity: Conformity, then: Decision) -> Decision {
    match conformity {
        Conformity::Holds => Decision::Accept,
        Conformity::Broken => then,
        Conformity::Undecided => Decision::Person,
    }
}

/// A line that a person decides.
pub(crate) fn undecided(figure: JudgedFigure, reason: &str) -> VerdictLine {
    VerdictLine {
        figure,
        component: None::<NamedClass>,
        defect: None,
        findings: Vec::new(),
        value: None,
        limit: None,
        conformity: Conformity::Undecided,
        decision: Decision::Person,
        reason: reason.into(),
    }
}
