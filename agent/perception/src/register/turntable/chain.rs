//! The angle of each view: views are placed where they are sure, and each is tried at the end without its own say.

use super::plane::Stage;
use super::profile::{ANGLE_STEP, ANGLES, Turning, profile, turning_points, value_at};
use super::refine::refine;
use super::thinned::TurningView;
use super::{NoAngle, Turntable, TurntableConfig, TurntableError, ViewAngle};
use rayon::prelude::*;

/// Points of a view whose profiles decide.
const POINTS: usize = 1200;
/// Fewest points of a view that turn.
const FEWEST_POINTS: usize = 60;
/// Views up to which all pairs are compared.
const ALL_PAIRS: usize = 26;
/// Distances in the order of capture at which views are compared where they are more.
const APART: [usize; 6] = [1, 2, 3, 5, 8, 13];
/// Radians about a peak that belong to it.
const PEAK: f64 = 0.24;
/// Least score of a view's best angle.
const LEAST_SCORE: f64 = 0.5;
/// Least margin of its score over that of the best other angle, absolute and as a share of the score.
const LEAST_MARGIN: (f64, f64) = (0.22, 0.12);

/// Least share of the views that show something that turns, that must be placed for any to be believed: where most are
/// ambiguous, the axis is not known either.
const LEAST_PLACED: f64 = 0.55;
/// Share of the best solution's worth from which on another one is a rival.
const RIVAL: f64 = 0.85;
/// Pairs of views from which solutions are grown.
const SEEDS: usize = 4;

/// Places all views, for the axis that suits them best of the `stages`.
pub(super) fn place(
    views: &[TurningView],
    stages: &[Stage],
    config: &TurntableConfig,
) -> Result<Turntable, TurntableError> {
    // Each place of the axis makes its best of all views, then they are compared.
    let mut made: Vec<Made> = stages.iter().filter_map(|stage| made(views, stage, config)).collect();
    made.sort_by(|a, b| b.worth().total_cmp(&a.worth()));
    let Some(best) = made.first() else { return Err(TurntableError::NothingTurns { pixels: 0 }) };
    // Once more with the exact axis.
    let attempt = Attempt::new(views, &best.stage, config);
    let solution = attempt.solutions.iter().max_by(|a, b| a.worth().total_cmp(&b.worth()));
    let solution = solution.ok_or(TurntableError::NothingTurns { pixels: 0 })?;
    let own = attempt.solutions.iter().map(|s| (s.differs(&solution.angles), s.worth() / solution.worth()));
    let others = made[1..].iter().map(|m| (differ(&m.angles, &solution.angles), m.worth() / best.worth()));
    let rival = own.chain(others).filter(|(differs, _)| *differs).map(|(_, share)| share).fold(0.0, f64::max);
    if rival > RIVAL {
        return Err(TurntableError::TwoSolutions { best: solution.worth(), next: rival * solution.worth() });
    }
    let Attempt { stage, points, graph, .. } = &attempt;
    let (axis, angles, _) =
        refine(views, points, &stage.changes, stage.axis, solution.angles.clone(), config.step.is_some());
    let n = views.len();
    let origin = angles.iter().flatten().next().copied().unwrap_or(0.0);
    let placed = angles.iter().flatten().count();
    let usable = points.iter().filter(|p| p.len() >= FEWEST_POINTS).count();
    if placed < 2 || (placed as f64) < LEAST_PLACED * usable as f64 {
        return Err(TurntableError::FewPlaced { placed, usable });
    }
    let angles: Vec<Result<ViewAngle, NoAngle>> = (0..n)
        .map(|i| {
            if points[i].len() < FEWEST_POINTS {
                return Err(NoAngle::NothingTurns { points: points[i].len() });
            }
            let judged = graph.judge(i, &angles);
            match angles[i] {
                Some(angle) => {
                    Ok(ViewAngle { radians: between(origin, angle), margin: judged.margin, score: judged.score })
                }
                None => Err(judged.refused.unwrap_or(NoAngle::NoFit { best: judged.score, needed: LEAST_SCORE })),
            }
        })
        .collect();
    Ok(Turntable { axis, radius: stage.radius, height: stage.height, angles })
}

/// From `a` to `b`, within half a turn.
fn between(a: f64, b: f64) -> f64 {
    let half = std::f64::consts::PI;
    (b - a + half).rem_euclid(2.0 * half) - half
}

/// Scores of pairs: for each view those with others, by the turn from the other to it.
struct Graph {
    scores: Vec<Vec<(usize, Vec<f32>)>>,
}

/// What a place of the axis makes of all views when it is made exact.
struct Made {
    stage: Stage,
    angles: Vec<Option<f64>>,
    /// Of a pair, on average.
    score: f64,
}

impl Made {
    fn worth(&self) -> f64 {
        self.score * self.angles.iter().flatten().count() as f64
    }
}

fn made(views: &[TurningView], stage: &Stage, config: &TurntableConfig) -> Option<Made> {
    let attempt = Attempt::new(views, stage, config);
    let best = attempt.solutions.iter().max_by(|a, b| a.worth().total_cmp(&b.worth()))?;
    let angles = best.angles.clone();
    let (axis, angles, score) =
        refine(views, &attempt.points, &stage.changes, stage.axis, angles, config.step.is_some());
    Some(Made { stage: Stage { axis, ..stage.clone() }, angles, score })
}

/// What comes out with one place of the axis.
struct Attempt<'a> {
    stage: &'a Stage,
    /// Points of each view that turn.
    points: Vec<Vec<Turning>>,
    graph: Graph,
    solutions: Vec<Solution>,
}

impl<'a> Attempt<'a> {
    fn new(views: &[TurningView], stage: &'a Stage, config: &TurntableConfig) -> Self {
        let points: Vec<Vec<Turning>> = views.par_iter().map(|v| turning_points(v, stage, 1.0, POINTS)).collect();
        let n = views.len();
        let pairs: Vec<(usize, usize)> = (0..n)
            .flat_map(|i| (i + 1..n).map(move |j| (i, j)))
            .filter(|(i, j)| n <= ALL_PAIRS || APART.contains(&(j - i)) || APART.contains(&(n + i - j)))
            .filter(|(i, j)| points[*i].len() >= FEWEST_POINTS && points[*j].len() >= FEWEST_POINTS)
            .collect();
        let of_pair = |&(i, j): &(usize, usize)| {
            profile((&views[i], &points[i]), (&views[j], &points[j]), &stage.changes, &stage.axis)
        };
        let profiles: Vec<Vec<f32>> = pairs.par_iter().map(of_pair).collect();
        let mut graph = Graph { scores: vec![Vec::new(); n] };
        for (&(i, j), scores) in pairs.iter().zip(&profiles) {
            graph.scores[j].push((i, scores.clone()));
            // The same turn the other way round.
            graph.scores[i].push((j, (0..ANGLES).map(|k| scores[(ANGLES - k) % ANGLES]).collect()));
        }
        let solutions = match config.step {
            Some(step) => [step, -step].map(|step| graph.with_step(step)).to_vec(),
            None => graph.seeds(&pairs, &profiles).into_iter().map(|seed| graph.grown(seed)).collect(),
        };
        Self { stage, points, graph, solutions }
    }
}

/// Angles of some views, and how well all pairs of these agree.
#[derive(Clone, Debug)]
struct Solution {
    angles: Vec<Option<f64>>,
    score: f64,
}

impl Solution {
    /// More views are worth more, however well they agree.
    fn worth(&self) -> f64 {
        self.score.max(0.0)
    }

    fn differs(&self, angles: &[Option<f64>]) -> bool {
        differ(&self.angles, angles)
    }
}

/// Whether two views turn otherwise in the one solution than in the other.
fn differ(a: &[Option<f64>], b: &[Option<f64>]) -> bool {
    let both: Vec<(f64, f64)> = a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
    let Some((first_a, first_b)) = both.first() else { return true };
    both.iter().any(|(x, y)| between(x - first_a, y - first_b).abs() > PEAK)
}

/// The best angle of a view, and why it does not hold.
#[derive(Clone, Copy, Debug)]
struct Judged {
    angle: f64,
    score: f64,
    margin: f64,
    refused: Option<NoAngle>,
}

fn rank(judged: &Judged) -> f64 {
    if judged.refused.is_some() { judged.margin - 100.0 } else { judged.margin }
}

impl Graph {
    /// Where to begin: the surest pairs, and all views at the one step that suits all neighbours best.
    fn seeds(&self, pairs: &[(usize, usize)], profiles: &[Vec<f32>]) -> Vec<Vec<Option<f64>>> {
        let n = self.scores.len();
        let mut judged: Vec<((usize, usize), Judged)> =
            pairs.iter().zip(profiles).map(|(pair, scores)| (*pair, judge(scores))).collect();
        judged.sort_by(|a, b| rank(&b.1).total_cmp(&rank(&a.1)));
        let pair = |((i, j), judged): ((usize, usize), Judged)| {
            let mut angles = vec![None; n];
            (angles[i], angles[j]) = (Some(0.0), Some(judged.angle));
            angles
        };
        let mut seeds: Vec<Vec<Option<f64>>> =
            judged.into_iter().take(SEEDS).filter(|(_, j)| j.refused.is_none()).map(pair).collect();
        let mut uniform = vec![0.0_f32; ANGLES];
        for (_, scores) in pairs.iter().zip(profiles).filter(|((i, j), _)| i + 1 == *j) {
            uniform.iter_mut().zip(scores).for_each(|(u, s)| *u += s);
        }
        let mut steps: Vec<usize> = (0..ANGLES).filter(|k| is_peak(&uniform, *k)).collect();
        steps.sort_by(|a, b| uniform[*b].total_cmp(&uniform[*a]));
        seeds.extend(steps.into_iter().take(2).map(|k| self.stepped(refined(&uniform, k))));
        seeds
    }

    /// All views that can be compared, `step` apart.
    fn stepped(&self, step: f64) -> Vec<Option<f64>> {
        self.scores.iter().enumerate().map(|(i, s)| (!s.is_empty()).then_some(step * i as f64)).collect()
    }

    /// The solution that grows from `angles`: views are added as long as one is sure, then each is tried again by the
    /// others, and the worst goes until all hold.
    fn grown(&self, mut angles: Vec<Option<f64>>) -> Solution {
        for _ in 0..2 {
            self.prune(&mut angles);
            loop {
                let next = (0..angles.len()).filter(|i| angles[*i].is_none()).map(|i| (i, self.judge(i, &angles)));
                match next.max_by(|a, b| rank(&a.1).total_cmp(&rank(&b.1))) {
                    Some((i, Judged { refused: None, angle, .. })) => angles[i] = Some(angle),
                    _ => break,
                }
            }
        }
        self.prune(&mut angles);
        self.solution(angles)
    }

    fn prune(&self, angles: &mut [Option<f64>]) {
        while angles.iter().flatten().count() > 2 {
            let mut worst: Option<(usize, f64)> = None;
            let mut moved = Vec::new();
            for (i, angle) in angles.iter().enumerate().filter_map(|(i, angle)| Some((i, (*angle)?))) {
                let judged = self.judge(i, angles);
                let elsewhere = between(angle, judged.angle).abs() > PEAK;
                let rank = if elsewhere { rank(&judged) - 200.0 } else { rank(&judged) };
                if (judged.refused.is_some() || elsewhere) && worst.is_none_or(|(_, least)| rank < least) {
                    worst = Some((i, rank));
                }
                moved.push((i, judged.angle));
            }
            match worst {
                Some((i, _)) => angles[i] = None,
                None => {
                    moved.into_iter().for_each(|(i, angle)| angles[i] = Some(angle));
                    break;
                }
            }
        }
    }

    /// The solution with a known `step`: views at whose angle the others do not agree are left out.
    fn with_step(&self, step: f64) -> Solution {
        let all = self.stepped(step);
        let holds = |i: usize| {
            let angle = all[i]?;
            let sum = self.sum(i, &all);
            let best = f64::from(sum.iter().copied().fold(f32::NEG_INFINITY, f32::max));
            let here = value_at(&sum, angle);
            (here >= LEAST_SCORE && here >= (1.0 - LEAST_MARGIN.1) * best).then_some(angle)
        };
        self.solution((0..all.len()).map(holds).collect())
    }

    fn solution(&self, angles: Vec<Option<f64>>) -> Solution {
        let of_view = |i: usize| -> Option<f64> { Some(value_at(&self.sum(i, &angles), angles[i]?)) };
        let score = (0..angles.len()).filter_map(of_view).sum();
        Solution { angles, score }
    }

    /// Scores of view `i` at each angle by the others that have one.
    fn sum(&self, i: usize, angles: &[Option<f64>]) -> Vec<f32> {
        let mut sum = vec![0.0_f32; ANGLES];
        for (other, scores) in self.scores[i].iter().filter(|(other, _)| *other != i) {
            let Some(angle) = angles[*other] else { continue };
            for (k, s) in sum.iter_mut().enumerate() {
                *s += value_at(scores, k as f64 * ANGLE_STEP - angle) as f32;
            }
        }
        sum
    }

    /// Judges view `i` against those of the others that have an angle.
    fn judge(&self, i: usize, angles: &[Option<f64>]) -> Judged {
        judge(&self.sum(i, angles))
    }
}

/// Whether a profile has a peak at `k`.
fn is_peak(scores: &[f32], k: usize) -> bool {
    let (left, right) = (scores[(k + ANGLES - 1) % ANGLES], scores[(k + 1) % ANGLES]);
    scores[k] >= left && scores[k] >= right
}

/// The best angle of a profile.
fn judge(scores: &[f32]) -> Judged {
    let best = (0..ANGLES).max_by(|a, b| scores[*a].total_cmp(&scores[*b])).unwrap_or(0);
    let angle = refined(scores, best);
    let apart = |k: usize| between(k as f64 * ANGLE_STEP, angle).abs() > PEAK;
    // A rival is a peak of its own, not the slope of the best one.
    let rival =
        (0..ANGLES).filter(|k| apart(*k) && is_peak(scores, *k)).max_by(|a, b| scores[*a].total_cmp(&scores[*b]));
    let score = f64::from(scores[best]);
    let next = rival.map_or(f64::NEG_INFINITY, |k| f64::from(scores[k]));
    let margin = if rival.is_some() { score - next } else { score };
    let refused = if score < LEAST_SCORE {
        Some(NoAngle::NoFit { best: score, needed: LEAST_SCORE })
    } else if margin < LEAST_MARGIN.0.max(LEAST_MARGIN.1 * score) {
        let other = rival.map_or(0.0, |k| (k as f64 * ANGLE_STEP).to_degrees());
        Some(NoAngle::Ambiguous { angle: angle.to_degrees(), best: score, other, next })
    } else {
        None
    };
    Judged { angle, score, margin, refused }
}

/// The peak between the angles of a profile, by a parabola.
fn refined(scores: &[f32], k: usize) -> f64 {
    let (a, b, c) = (scores[(k + ANGLES - 1) % ANGLES], scores[k], scores[(k + 1) % ANGLES]);
    let curvature = a - 2.0 * b + c;
    let shift = if curvature < -1e-9 { (0.5 * (a - c) / curvature).clamp(-0.5, 0.5) } else { 0.0 };
    (k as f64 + f64::from(shift)) * ANGLE_STEP
}
