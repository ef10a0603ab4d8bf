//! One photograph for each face, so that neighbours have the same: a labelling with little cost of the faces and few sides
//! between different photographs, as [Waechter 2014], section 3.1, has it.
//!
//! The cost of a photograph for a face is how much less of it the photograph shows than the best one does, and how far its colour
//! lies off those of the others: highlights, shadows and hands are only in some. Costs are averaged over the neighbourhood, each
//! face takes the least, then single faces change as long as that helps ([Besag 1986]), then whole regions.

use crate::sights::{Sight, Sights};
use crate::surface::Surface;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Standard deviation in levels of a photograph's colour from the others', and the most that it costs.
const COLOR_SPREAD: f32 = 24.0;
const MOST_COLOR_COST: f32 = 3.0;
/// Rounds in which costs are averaged with those of the neighbours.
const AVERAGING: usize = 12;
/// Cost of a photograph that does not show a neighbour.
const UNSEEN_BESIDE: f32 = 4.0;
/// Cost of a side between two photographs.
const SIDE: f32 = 1.0;
/// Rounds in which single faces and regions change.
const ROUNDS: usize = 24;
/// Regions of fewer faces go to a neighbour that shows them, whatever it costs.
const SMALL: usize = 16;

/// Costs of the photographs that show a face, by photograph.
type Costs = Vec<(u32, f32)>;

/// The photograph of each face; `None` where none shows it.
pub(crate) fn assign_views(surface: &Surface, sights: &Sights) -> Vec<Option<u32>> {
    let own: Vec<Costs> = sights.of_faces.par_iter().map(|sights| costs(sights)).collect();
    let mut averaged = own;
    for _ in 0..AVERAGING {
        averaged = (0..averaged.len()).into_par_iter().map(|face| with_beside(surface, &averaged, face)).collect();
    }
    let least = |costs: &Costs| costs.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(view, _)| *view);
    let mut views: Vec<Option<u32>> = averaged.par_iter().map(least).collect();
    for _ in 0..ROUNDS {
        if !change_faces(surface, &averaged, &mut views) {
            break;
        }
    }
    for _ in 0..ROUNDS {
        if !change_regions(surface, &averaged, &mut views) {
            break;
        }
    }
    views
}

/// What each photograph costs for a face.
fn costs(sights: &[Sight]) -> Costs {
    let best = sights.iter().map(|sight| sight.quality).fold(0.0, f32::max);
    let usual = usual_color(sights);
    let mut costs: Costs = sights
        .iter()
        .map(|sight| {
            let off = distance(sight.color, usual) / COLOR_SPREAD;
            let blur = (best / sight.quality.max(f32::MIN_POSITIVE)).ln();
            (sight.view, blur + (0.5 * off * off).min(MOST_COLOR_COST))
        })
        .collect();
    costs.sort_unstable_by_key(|(view, _)| *view);
    costs
}

/// The colour that most photographs have there: a mean in which those far off count less, in two rounds.
fn usual_color(sights: &[Sight]) -> [f32; 3] {
    let mut usual: Option<[f32; 3]> = None;
    for _ in 0..3 {
        let (mut sum, mut weights) = ([0.0_f32; 3], 0.0_f32);
        for sight in sights {
            let off = usual.map_or(0.0, |usual| distance(sight.color, usual) / COLOR_SPREAD);
            let weight = (-0.5 * off * off).exp().max(1e-3);
            sum = [0, 1, 2].map(|k| sum[k] + weight * sight.color[k]);
            weights += weight;
        }
        usual = (weights > 0.0).then(|| sum.map(|c| c / weights));
    }
    usual.unwrap_or([0.0; 3])
}

/// Mean over the channels of how far two colours are apart.
fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).abs()).sum::<f32>() / 3.0
}

/// Costs of a face, halfway to the mean of those beside it.
fn with_beside(surface: &Surface, costs: &[Costs], face: usize) -> Costs {
    let beside: Vec<usize> = surface.beside(face).filter(|other| !costs[*other].is_empty()).collect();
    if beside.is_empty() {
        return costs[face].clone();
    }
    let mixed = |(view, own): &(u32, f32)| {
        let mean = beside.iter().map(|other| cost(&costs[*other], *view).unwrap_or(UNSEEN_BESIDE)).sum::<f32>();
        (*view, 0.5 * own + 0.5 * mean / beside.len() as f32)
    };
    costs[face].iter().map(mixed).collect()
}

fn cost(costs: &Costs, view: u32) -> Option<f32> {
    costs.binary_search_by_key(&view, |(view, _)| *view).ok().map(|place| costs[place].1)
}

/// Gives each face in turn the photograph that is best among those beside it. Returns whether any has changed.
fn change_faces(surface: &Surface, costs: &[Costs], views: &mut [Option<u32>]) -> bool {
    let mut has_changed = false;
    for face in 0..views.len() {
        let Some(own) = views[face] else { continue };
        let sides = |view: u32, views: &[Option<u32>]| {
            SIDE * surface.beside(face).filter(|other| views[*other].is_some_and(|beside| beside != view)).count()
                as f32
        };
        let mut best = (own, cost(&costs[face], own).unwrap_or(f32::INFINITY) + sides(own, views));
        for other in surface.beside(face) {
            let Some(view) = views[other].filter(|view| *view != best.0) else { continue };
            let Some(cost) = cost(&costs[face], view) else { continue };
            let sum = cost + sides(view, views);
            if sum < best.1 - 1e-6 {
                best = (view, sum);
            }
        }
        has_changed |= best.0 != own;
        views[face] = Some(best.0);
    }
    has_changed
}

/// Gives each region of one photograph in turn, the smallest first, that of a region beside it, if that shows all of it and the sum
/// of costs becomes less, or the region is small. Returns whether any has changed.
fn change_regions(surface: &Surface, costs: &[Costs], views: &mut [Option<u32>]) -> bool {
    let mut regions = regions(surface, views);
    regions.sort_by_key(|region| region.faces.len());
    let mut has_changed = false;
    for Region { view, faces } in regions {
        // A neighbour's change may have made it part of a larger one.
        let mut sides: BTreeMap<u32, usize> = BTreeMap::new();
        for other in faces.iter().flat_map(|face| surface.beside(*face)) {
            if let Some(beside) = views[other].filter(|beside| *beside != view) {
                *sides.entry(beside).or_default() += 1;
            }
        }
        let gains = sides.into_iter().filter_map(|(other, sides)| {
            let mut gain = SIDE * sides as f32;
            for face in &faces {
                gain += cost(&costs[*face], view)? - cost(&costs[*face], other)?;
            }
            Some((other, gain))
        });
        let best = gains.max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((other, _)) = best.filter(|(_, gain)| *gain > 1e-4 || faces.len() < SMALL) else { continue };
        faces.iter().for_each(|face| views[*face] = Some(other));
        has_changed = true;
    }
    has_changed
}

/// Faces that hang together and have one photograph.
pub(crate) struct Region {
    pub(crate) view: u32,
    pub(crate) faces: Vec<usize>,
}

/// All of them, in the order of their first faces.
pub(crate) fn regions(surface: &Surface, views: &[Option<u32>]) -> Vec<Region> {
    let mut is_taken = vec![false; views.len()];
    let mut regions = Vec::new();
    for first in 0..views.len() {
        let Some(view) = views[first].filter(|_| !is_taken[first]) else { continue };
        is_taken[first] = true;
        let (mut faces, mut next) = (vec![first], 0);
        while let Some(face) = faces.get(next).copied() {
            next += 1;
            for other in surface.beside(face) {
                if !is_taken[other] && views[other] == Some(view) {
                    is_taken[other] = true;
                    faces.push(other);
                }
            }
        }
        faces.sort_unstable();
        regions.push(Region { view, faces });
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::quad;
    use semascan_model::SemanticMesh;

    fn surface() -> Surface {
        let mut mesh = SemanticMesh::default();
        quad(&mut mesh, [0.0, 0.0], [0.1, 0.1], 0.0);
        Surface::of(&mesh)
    }

    fn sight(view: u32, quality: f32, color: [f32; 3]) -> Sight {
        Sight { view, quality, color }
    }

    /// View 0 is better on the left and view 1 on the right, each with noise.
    fn halves(surface: &Surface) -> Sights {
        let mut sights = Sights::new(surface);
        for (face, list) in sights.of_faces.iter_mut().enumerate() {
            let x = surface.middle(face).x;
            let noise = 1.0 + 0.8 * ((face * 7919 % 13) as f32 / 13.0 - 0.5);
            let (left, right) = if x < 0.05 { (3.0, 1.0) } else { (1.0, 3.0) };
            *list = vec![sight(0, left * noise, [80.0; 3]), sight(1, right / noise, [80.0; 3])];
        }
        sights
    }

    #[test]
    fn two_halves_become_two_regions_in_spite_of_noise() {
        let surface = surface();
        let views = assign_views(&surface, &halves(&surface));
        let regions = regions(&surface, &views);
        assert_eq!(regions.len(), 2);
        let right = regions.iter().filter(|region| region.view == 1).flat_map(|region| &region.faces);
        let wrong = right.filter(|face| surface.middle(**face).x < 0.04).count();
        assert_eq!(wrong, 0);
    }

    #[test]
    fn a_highlight_in_the_best_photograph_is_passed_over_and_unseen_faces_stay_so() {
        let surface = surface();
        let mut sights = Sights::new(&surface);
        for (face, list) in sights.of_faces.iter_mut().enumerate() {
            let middle = surface.middle(face);
            if middle.y > 0.08 {
                continue;
            }
            let glare = if middle.x > 0.06 { [250.0; 3] } else { [80.0; 3] };
            *list = vec![sight(0, 1.5, glare), sight(1, 1.0, [82.0; 3]), sight(2, 0.5, [78.0; 3])];
        }
        let views = assign_views(&surface, &sights);
        for (face, view) in views.iter().enumerate() {
            let middle = surface.middle(face);
            match view {
                None => assert!(middle.y > 0.08),
                Some(view) if middle.x > 0.07 => assert_ne!(*view, 0, "{middle}"),
                Some(view) if middle.x < 0.05 => assert_eq!(*view, 0, "{middle}"),
                Some(_) => {}
            }
        }
    }

    #[test]
    fn a_speck_goes_to_what_surrounds_it_if_that_shows_it() {
        let surface = surface();
        let mut sights = Sights::new(&surface);
        let speck: Vec<usize> = (0..3).map(|k| 2 * (20 * 10 + 10) + k).collect();
        for (face, list) in sights.of_faces.iter_mut().enumerate() {
            *list = vec![sight(0, 1.0, [80.0; 3])];
            if speck.contains(&face) {
                list.push(sight(1, 9.0, [80.0; 3]));
            }
        }
        assert!(assign_views(&surface, &sights).iter().all(|view| *view == Some(0)));
        speck.iter().for_each(|face| sights.of_faces[*face] = vec![sight(1, 9.0, [80.0; 3])]);
        let views = assign_views(&surface, &sights);
        assert!(speck.iter().all(|face| views[*face] == Some(1)), "no other shows it");
    }
}
