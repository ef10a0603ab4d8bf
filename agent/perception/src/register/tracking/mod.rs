//! A moving camera, tracked frame by frame: the pose of each view of a handheld RGB-D camera, without any other evidence.
//!
//! [`Tracker::track`] takes one view: it is aligned with the keyframes that show the same surface (`alignment`), from where
//! the camera was heading (`motion`), and averaged into the keyframe that shows most of it (`keyframe`). A view that shows
//! enough that is new becomes a keyframe. It is linked with every earlier keyframe whose surface and picture it is found to
//! show again, also where drift has carried them apart, and all keyframes move so that these ways agree (`graph`). A view
//! that fits nowhere is lost, with the reason (`health`), until a later one is found again from the places that look alike
//! (`thumbnail`).
//!
//! Model-based tracking is that of [Newcombe 2011]; surface and picture together, and a model that bends, are of
//! [Whelan 2016]; keyframes of depth with direct alignment of [Kerl 2013] and [Schops 2019]; the motion of [Vizzo 2023].
//! Results do not depend on the number of threads, nor on time: a slow machine is slow.

mod alignment;
mod frame;
mod graph;
mod health;
mod keyframe;
mod linking;
mod motion;
#[cfg(test)]
mod tests;
mod thumbnail;

pub use health::{Health, Lost};

use crate::view::{View, covariance_of_prior};
use alignment::{Search, Target, align, covered};
use frame::Frame;
use graph::Graph;
use health::plausible;
use keyframe::Keyframe;
use motion::Motion;
use nalgebra::{Isometry3, Matrix6};
use thumbnail::Thumbnail;

/// Keyframes that a frame is aligned with.
const TARGETS: usize = 3;
/// Share of a frame that a keyframe has to show to be aligned with.
const SHARED: f64 = 0.25;
/// A frame of which its keyframe shows less becomes a keyframe.
const NEW: f64 = 0.55;
/// By how much more another keyframe has to show of a frame to take it over.
const MORE: f64 = 0.08;
/// The search of a frame, in standard deviations of the prediction, and at least: metres a metre of distance.
const REACH: f64 = 3.0;
const LEAST_REACH: f64 = 0.02;
/// The search where something is looked for that may be anywhere near: metres a metre of distance.
const WIDE: f64 = 0.15;
/// Standard deviations of a guess: radians and metres.
const GUESS: (f64, f64) = (0.3, 0.3);
/// Correlation of the pictures of a lost camera and of the place where it is found.
const SAME_PICTURE: f64 = 0.5;
/// Standard deviations that the way between two keyframes is believed to have at least, radians and metres: depth cameras bend
/// what they see.
const LINK_FLOOR: (f64, f64) = (1e-3, 2e-3);
/// A frame that looks less alike than this to every remembered place is remembered as one.
const FAMILIAR: f32 = 0.85;
/// Places from which a lost camera is looked for, in each frame.
const GUESSES: usize = 3;
/// Share of a frame's points that must lie on the model for a lost camera to be found.
const FOUND: f64 = 0.5;

/// What became of one view.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// The camera's pose in the frame of the first view's camera, as it is known by now; `None` if it is lost.
    pub world_from_camera: Option<Isometry3<f64>>,
    /// How well it is tracked, or why it is not.
    pub health: Result<Health, Lost>,
    /// Whether the view is a keyframe.
    pub keyframe: bool,
    /// Whether it was lost before and has been found again.
    pub found_again: bool,
    /// Earlier keyframes that it closes a loop with.
    pub loops: usize,
}

/// Tracks one camera; see the module.
#[derive(Default)]
pub struct Tracker {
    keyframes: Vec<Keyframe>,
    graph: Graph,
    motion: Motion,
    /// The keyframe that shows most of the last frame.
    reference: usize,
    /// Of the last frame that was found.
    reference_from_camera: Isometry3<f64>,
    /// Frames since the camera was lost.
    lost: usize,
    places: Vec<Place>,
    followed: Vec<Option<Followed>>,
}

/// Where a frame was, relative to a keyframe, with which it moves.
#[derive(Clone, Copy, Debug)]
struct Followed {
    keyframe: usize,
    keyframe_from_camera: Isometry3<f64>,
}

/// A place that is recognised by its looks.
struct Place {
    thumbnail: Thumbnail,
    at: Followed,
}

impl Tracker {
    /// Tracks the next view of the camera. Its pose evidence, labels and truth are not looked at.
    pub fn track(&mut self, view: &View) -> Tracked {
        let tracked = match Frame::new(view) {
            None => self.lose(Lost::NoDepth),
            Some(frame) if self.keyframes.is_empty() => self.begin(&frame),
            Some(frame) => self.follow(&frame),
        };
        let at = Followed { keyframe: self.reference, keyframe_from_camera: self.reference_from_camera };
        self.followed.push(tracked.world_from_camera.map(|_| at));
        tracked
    }

    /// Where each view was, as it is known by now: the frame of the first view's camera. `None` where it was lost.
    pub fn trajectory(&self) -> Vec<Option<Isometry3<f64>>> {
        self.followed.iter().map(|at| at.map(|at| self.place_of(&at))).collect()
    }

    /// Number of keyframes.
    pub fn keyframes(&self) -> usize {
        self.keyframes.len()
    }

    /// Covariance of the last pose over (rotation, translation), camera frame, radians and metres: what has drifted since the
    /// first view.
    pub fn covariance(&self) -> Matrix6<f64> {
        let (rotation, translation) = LINK_FLOOR;
        let own = covariance_of_prior(rotation, translation);
        if self.keyframes.is_empty() { own } else { own + self.graph.covariance(&self.poses(), self.reference) }
    }

    fn place_of(&self, at: &Followed) -> Isometry3<f64> {
        self.keyframes[at.keyframe].pose() * at.keyframe_from_camera
    }

    fn poses(&self) -> Vec<Isometry3<f64>> {
        self.keyframes.iter().map(Keyframe::pose).collect()
    }

    /// Where the camera was last.
    fn last(&self) -> Isometry3<f64> {
        self.place_of(&Followed { keyframe: self.reference, keyframe_from_camera: self.reference_from_camera })
    }

    /// The first frame says where the world is.
    fn begin(&mut self, frame: &Frame) -> Tracked {
        self.keyframes.push(Keyframe::new(frame, Isometry3::identity(), &[]));
        self.reference_from_camera = Isometry3::identity();
        self.remember(frame);
        let health = Health { overlap: 1.0, sigma: 0.0, alike: None, left_open: 0 };
        Tracked {
            world_from_camera: Some(Isometry3::identity()),
            health: Ok(health),
            keyframe: true,
            found_again: false,
            loops: 0,
        }
    }

    fn lose(&mut self, why: Lost) -> Tracked {
        if self.lost == 0 {
            tracing::info!("frame {}: lost: {why}", self.followed.len());
        }
        self.lost += 1;
        self.motion = Motion::default();
        Tracked { world_from_camera: None, health: Err(why), keyframe: false, found_again: false, loops: 0 }
    }

    /// A frame after the first one.
    fn follow(&mut self, frame: &Frame) -> Tracked {
        let was_lost = self.lost > 0;
        let found = if was_lost { self.find(frame) } else { self.go_on(frame) };
        let (pose, health) = match found {
            Ok(found) => found,
            Err(why) => return self.lose(why),
        };
        if was_lost {
            tracing::info!("frame {}: found again after {} frames", self.followed.len(), self.lost);
            self.lost = 0;
        } else {
            let last = self.last();
            self.motion.moved(&last, &pose);
        }
        let shown = self.choose_reference(frame, &pose);
        self.reference_from_camera = self.keyframes[self.reference].pose().inverse() * pose;
        self.keyframes[self.reference].fuse(frame, &pose);
        let is_new = shown < NEW;
        let loops = if is_new { self.add_keyframe(frame, pose) } else { 0 };
        self.remember(frame);
        Tracked {
            world_from_camera: Some(self.last()),
            health: Ok(health),
            keyframe: is_new,
            found_again: was_lost,
            loops,
        }
    }

    /// From where the camera was heading; once more with a wider search from where it was.
    fn go_on(&self, frame: &Frame) -> Result<(Isometry3<f64>, Health), Lost> {
        let (last, distance) = (self.last(), frame.centre.z);
        let predicted = self.motion.predict(&last);
        let (turn, shift) = self.motion.sigma();
        let reach = (REACH * (shift + turn * frame.radius)).clamp(LEAST_REACH * distance, WIDE * distance);
        let (rotation, translation) = GUESS;
        let searches = [
            Search { start: predicted, covariance: self.motion.covariance(), reach },
            Search { start: last, covariance: covariance_of_prior(rotation, translation), reach: WIDE * distance },
        ];
        let mut failure = Lost::Nowhere;
        for search in searches {
            let targets = self.targets(frame, &search.start, self.reference);
            let Some(alignment) = align(frame, &targets, &search) else { continue };
            let pose = alignment.world_from_camera;
            match Health::of(&alignment, distance).and_then(|h| plausible(&self.motion, &last, &pose).map(|()| h)) {
                Ok(health) => return Ok((pose, health)),
                Err(why) => failure = why,
            }
        }
        Err(failure)
    }

    /// Looks for a lost camera: at the places that look alike, and where it was last.
    fn find(&self, frame: &Frame) -> Result<(Isometry3<f64>, Health), Lost> {
        let mut places: Vec<(f32, usize)> =
            self.places.iter().enumerate().map(|(i, place)| (frame.thumbnail.alike(&place.thumbnail), i)).collect();
        places.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let last = Followed { keyframe: self.reference, keyframe_from_camera: self.reference_from_camera };
        let guesses = places.iter().take(GUESSES).map(|(_, i)| self.places[*i].at).chain([last]);
        let (rotation, translation) = GUESS;
        let mut failure = Lost::Nowhere;
        for guess in guesses {
            let start = self.place_of(&guess);
            let search =
                Search { start, covariance: covariance_of_prior(rotation, translation), reach: WIDE * frame.centre.z };
            let Some(alignment) = align(frame, &self.targets(frame, &start, guess.keyframe), &search) else { continue };
            match Health::of(&alignment, frame.centre.z) {
                Ok(health) if health.overlap < FOUND => {
                    failure = Lost::LittleOverlap { found: health.overlap * 100.0, needed: FOUND * 100.0 };
                }
                // Nothing was foreseen, so that the pictures have to say that it is the same place.
                Ok(Health { alike: Some(correlation), .. }) if correlation < SAME_PICTURE => {
                    failure = Lost::Unlike { correlation };
                }
                Ok(health) => return Ok((alignment.world_from_camera, health)),
                Err(why) => failure = why,
            }
        }
        Err(failure)
    }

    /// The keyframes that show most of a frame at `pose`, `first` and those that it is linked with; the best one first.
    fn targets(&self, frame: &Frame, pose: &Isometry3<f64>, first: usize) -> Vec<Target<'_>> {
        let mut shown = self.shown(frame, pose, first);
        shown.retain(|(share, keyframe)| *share > SHARED || *keyframe == first);
        shown.truncate(TARGETS);
        if !shown.iter().any(|(_, keyframe)| *keyframe == first) {
            shown.pop();
            shown.push((0.0, first));
        }
        shown.into_iter().map(|(_, keyframe)| self.keyframes[keyframe].target()).collect()
    }

    /// How much of a frame at `pose` is shown by `first` and by the keyframes that it is linked with; most first.
    fn shown(&self, frame: &Frame, pose: &Isometry3<f64>, first: usize) -> Vec<(f64, usize)> {
        let mut candidates: Vec<usize> = self.graph.neighbours(first).chain([first]).collect();
        candidates.sort_unstable();
        candidates.dedup();
        self.shares(frame, pose, candidates)
    }

    fn shares(&self, frame: &Frame, pose: &Isometry3<f64>, candidates: Vec<usize>) -> Vec<(f64, usize)> {
        let share = |i: usize| covered(&frame.points, &[&self.keyframes[i].surface], pose);
        let mut shares: Vec<(f64, usize)> = candidates.into_iter().map(|i| (share(i), i)).collect();
        shares.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        shares
    }

    /// Chooses the keyframe that frames are averaged into; what it shows of this one.
    fn choose_reference(&mut self, frame: &Frame, pose: &Isometry3<f64>) -> f64 {
        let shown = self.shown(frame, pose, self.reference);
        let own = shown.iter().find(|(_, i)| *i == self.reference).map_or(0.0, |(share, _)| *share);
        match shown.first() {
            Some((share, best)) if *share > own + MORE => {
                self.reference = *best;
                *share
            }
            _ => own,
        }
    }

    /// Makes a keyframe of a frame, links it and moves all keyframes; the loops that it closes.
    fn add_keyframe(&mut self, frame: &Frame, pose: Isometry3<f64>) -> usize {
        let new = self.keyframes.len();
        let local: Vec<usize> = self.shown(frame, &pose, self.reference).into_iter().map(|(_, i)| i).collect();
        let lenders: Vec<&Keyframe> = local.iter().take(TARGETS).map(|i| &self.keyframes[*i]).collect();
        let keyframe = Keyframe::new(frame, pose, &lenders);
        let links = self.links(frame, &pose, new, &local);
        let loops = links.iter().filter(|link| !local.contains(&link.a)).count();
        self.keyframes.push(keyframe);
        self.graph.links.extend(links);
        (self.reference, self.reference_from_camera) = (new, Isometry3::identity());
        let poses = self.graph.optimised(&self.poses());
        for (keyframe, pose) in self.keyframes.iter_mut().zip(poses) {
            keyframe.surface.table_from_camera = pose;
        }
        loops
    }

    /// Remembers a place that looks new.
    fn remember(&mut self, frame: &Frame) {
        let is_familiar = self.places.iter().any(|place| place.thumbnail.alike(&frame.thumbnail) > FAMILIAR);
        if !is_familiar {
            let at = Followed { keyframe: self.reference, keyframe_from_camera: self.reference_from_camera };
            self.places.push(Place { thumbnail: frame.thumbnail.clone(), at });
        }
    }
}
