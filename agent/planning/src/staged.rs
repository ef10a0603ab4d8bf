//! Both stages as one planner: the whole surface by another planner, then close looks at what was found on the model.

use crate::reach::Reach;
use crate::regions::defect_regions;
use crate::targeted::{Camera, look_closely};
use semascan_geometry::mesh::{MeshOptions, mesh_cloud};
use semascan_inspection::planning::{Decision, NextView, ViewPlanner};
use semascan_inspection::spec::{PlanSpec, PlanStrategy};
use semascan_model::Taxonomy;
use semascan_model::record::PlanPurpose;
use semascan_perception::fuse::SemanticMap;
use semascan_perception::view::Intrinsics;
use std::collections::VecDeque;

/// An overall inspection, then a targeted one.
pub(crate) struct Staged {
    overall: Box<dyn ViewPlanner>,
    reach: Reach,
    camera: Intrinsics,
    spec: PlanSpec,
    taxonomy: Taxonomy,
    /// How the first stage ended, and what of the second is left; `None` during the first.
    targeted: Option<(Decision, VecDeque<NextView>)>,
}

impl Staged {
    pub(crate) fn new(
        overall: Box<dyn ViewPlanner>,
        reach: Reach,
        camera: Intrinsics,
        spec: &PlanSpec,
        taxonomy: Taxonomy,
    ) -> Self {
        Self { overall, reach, camera, spec: spec.clone(), taxonomy, targeted: None }
    }

    /// Close looks at the defects on the model as it is now.
    fn close_looks(&self, map: &SemanticMap) -> VecDeque<NextView> {
        let voxel = map.config().voxel;
        let mesh = match mesh_cloud(&map.cloud(), voxel as f32, &MeshOptions::default(), &()) {
            Ok(mesh) => mesh,
            Err(error) => {
                tracing::warn!("no close looks are planned: the model has no mesh: {error}");
                return VecDeque::new();
            }
        };
        let target = &self.spec.target;
        let regions = defect_regions(&mesh, &self.taxonomy, 1e-3 * target.least_mm);
        let camera = Camera::new(self.camera, target);
        let surface = (mesh.vertices.positions.as_slice(), voxel);
        let mut plan = look_closely(&regions, surface, &camera, &self.reach, self.spec.refine_views);
        if plan.views.is_empty() {
            // A camera that is too coarse looks as closely as it can.
            let coarse = plan.regions.iter().filter_map(|region| region.finest_pixel).fold(0.0, f64::max);
            if coarse > camera.pixel {
                tracing::warn!(
                    "the camera cannot show {:.2} mm a pixel here: looked at with up to {:.2} mm",
                    1e3 * camera.pixel,
                    1e3 * coarse
                );
                let camera = Camera { pixel: coarse, ..camera };
                plan = look_closely(&regions, surface, &camera, &self.reach, self.spec.refine_views);
            }
        }
        let next = plan.views.into_iter().map(|view| NextView {
            viewpoint: view.viewpoint,
            purpose: PlanPurpose::Targeted { regions: view.regions.iter().map(|i| regions[*i].name.clone()).collect() },
            expected: None,
            candidates: 0,
        });
        next.collect()
    }
}

impl ViewPlanner for Staged {
    fn strategy(&self) -> PlanStrategy {
        self.overall.strategy()
    }

    fn seed(&self) -> u64 {
        self.overall.seed()
    }

    fn most_views(&self) -> u32 {
        self.overall.most_views() + self.spec.refine_views
    }

    fn next(&mut self, model: Option<&SemanticMap>) -> Decision {
        if self.targeted.is_none() {
            let decision = self.overall.next(model);
            let Decision::Stop { .. } = &decision else { return decision };
            let looks = model.map_or_else(VecDeque::new, |map| self.close_looks(map));
            self.targeted = Some((decision, looks));
        }
        match &mut self.targeted {
            Some((end, looks)) => {
                looks.pop_front().map_or_else(|| end.clone(), |next| Decision::Capture(Box::new(next)))
            }
            None => self.overall.next(model),
        }
    }
}
