//! Elements are recovered from noise and outliers, wherever they stand, and are uncertain by what is stated.

use super::element::across;
use super::*;
use crate::measure::dimensions::Estimate;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use semascan_model::{SemanticMesh, SemanticPoint};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const SIGMA: f64 = 1e-4;
const KINDS: [ElementKind; 4] = [ElementKind::Plane, ElementKind::Cylinder, ElementKind::Sphere, ElementKind::Circle];

/// Points that err each on its own.
const INDEPENDENT: SurfaceErrors =
    SurfaceErrors { tolerance: 5.0 * SIGMA, correlation: 0.0, surface: 0.0, poses: 0.0, turn: 0.0 };

fn normal(random: &mut Pcg64Mcg) -> f64 {
    let radius = (-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt();
    radius * (TAU * random.random::<f64>()).cos()
}

fn pose(random: &mut Pcg64Mcg) -> Isometry3<f64> {
    let turn = Vector3::from_fn(|_, _| 2.0 * random.random::<f64>() - 1.0) * PI;
    let way = Vector3::from_fn(|_, _| random.random::<f64>() - 0.5);
    Isometry3::from_parts(Translation3::from(way), UnitQuaternion::from_scaled_axis(turn))
}

/// The element of a kind that the points of [`exact`] lie on, in its own frame.
fn truth(kind: ElementKind) -> Element {
    let (point, z) = (Vector3::zeros(), Vector3::z());
    match kind {
        ElementKind::Plane => Element::Plane(Plane { point, normal: z }),
        ElementKind::Cylinder => Element::Cylinder(Cylinder { point, axis: z, radius: 0.02 }),
        ElementKind::Sphere => Element::Sphere(Sphere { centre: point, radius: 0.02 }),
        ElementKind::Circle => Element::Circle(Circle { centre: point, normal: z, radius: 0.02 }),
    }
}

/// A point of the element, and the direction in which it may err.
fn exact(kind: ElementKind, random: &mut Pcg64Mcg) -> SurfacePoint {
    let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
    let turn = between(-1.2, 1.2);
    let out = Vector3::new(turn.cos(), turn.sin(), 0.0);
    let (position, normal) = match kind {
        ElementKind::Plane => (Vector3::new(between(-0.02, 0.02), between(-0.02, 0.02), 0.0), Vector3::z()),
        ElementKind::Cylinder => (out * 0.02 + Vector3::z() * between(-0.015, 0.015), out),
        ElementKind::Sphere => {
            let lift = between(-0.8, 0.8);
            let normal = out * lift.cos() + Vector3::z() * lift.sin();
            (normal * 0.02, normal)
        }
        ElementKind::Circle => (out * 0.02, out),
    };
    SurfacePoint { position, normal, weight: 1.0 }
}

/// Noisy points of an element in a pose; of every five the last is an outlier where there are some.
fn points(kind: ElementKind, count: usize, outliers: bool, pose: &Isometry3<f64>, seed: u64) -> Vec<SurfacePoint> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut point = |k: usize| {
        let mut point = exact(kind, &mut random);
        let direction = point.normal;
        point.position += direction * SIGMA * normal(&mut random);
        if kind == ElementKind::Circle {
            point.position.z += SIGMA * normal(&mut random);
        }
        // Normals of a mesh are off by some degrees.
        let tilt = Vector3::from_fn(|_, _| 0.05 * normal(&mut random));
        point.normal = (point.normal + tilt).normalize();
        if outliers && k % 5 == 4 {
            point.position += Vector3::from_fn(|_, _| 0.02 * (random.random::<f64>() - 0.5));
        }
        SurfacePoint {
            position: pose.transform_point(&point.position.into()).coords,
            normal: pose * point.normal,
            weight: point.weight,
        }
    };
    (0..count).map(&mut point).collect()
}

fn moved(element: &Element, pose: &Isometry3<f64>) -> Element {
    let place = |p: Vector3<f64>| pose.transform_point(&p.into()).coords;
    match *element {
        Element::Plane(Plane { point, normal }) => Element::Plane(Plane { point: place(point), normal: pose * normal }),
        Element::Cylinder(Cylinder { point, axis, radius }) => {
            Element::Cylinder(Cylinder { point: place(point), axis: pose * axis, radius })
        }
        Element::Sphere(Sphere { centre, radius }) => Element::Sphere(Sphere { centre: place(centre), radius }),
        Element::Circle(Circle { centre, normal, radius }) => {
            Element::Circle(Circle { centre: place(centre), normal: pose * normal, radius })
        }
    }
}

/// How far two elements are apart: radius, direction (as the way at 20 mm) and the place across it, metres.
fn apart(a: &Element, b: &Element) -> f64 {
    let radius = a.radius().unwrap_or(0.0) - b.radius().unwrap_or(0.0);
    let turn = a.direction().zip(b.direction()).map_or(0.0, |(a, b)| 0.02 * a.cross(&b).norm());
    let between = a.middle() - b.middle();
    let place = match (a, b) {
        (Element::Plane(plane), _) => plane.normal.dot(&between).abs(),
        (Element::Cylinder(cylinder), _) => cylinder.axis.cross(&between).norm(),
        _ => between.norm(),
    };
    radius.abs().max(turn).max(place)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn truth_is_recovered_from_noise_and_outliers(kind in 0_usize..4, seed in any::<u64>()) {
        let pose = pose(&mut Pcg64Mcg::seed_from_u64(seed ^ 1));
        let fit = Fit::new(KINDS[kind], &points(KINDS[kind], 600, true, &pose, seed), &INDEPENDENT).expect("an element");
        let off = apart(&fit.element, &moved(&truth(KINDS[kind]), &pose));
        prop_assert!(off < SIGMA, "{off} m, {fit:?}");
        prop_assert!((430..=545).contains(&fit.used) && fit.used + fit.left_out == 600, "{} used", fit.used);
        prop_assert!((0.8..1.4).contains(&(fit.rms / SIGMA)), "{}", fit.rms);
    }

    #[test]
    fn a_rigid_motion_moves_the_element_along(kind in 0_usize..4, seed in any::<u64>()) {
        let kind = KINDS[kind];
        let here = points(kind, 300, true, &Isometry3::identity(), seed);
        let pose = pose(&mut Pcg64Mcg::seed_from_u64(!seed));
        let there: Vec<SurfacePoint> = here
            .iter()
            .map(|p| SurfacePoint {
                position: pose.transform_point(&p.position.into()).coords,
                normal: pose * p.normal,
                weight: p.weight,
            })
            .collect();
        let [here, there] = [here, there].map(|points| Fit::new(kind, &points, &INDEPENDENT).expect("an element"));
        let off = apart(&there.element, &moved(&here.element, &pose));
        prop_assert!(off < 1e-8, "{off} m");
        prop_assert_eq!((here.used, here.left_out), (there.used, there.left_out));
        if let (Some(a), Some(b)) = (here.radius(), there.radius()) {
            prop_assert!((a.standard_uncertainty / b.standard_uncertainty - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn no_points_make_it_panic(kind in 0_usize..4, cloud in prop::collection::vec(prop::array::uniform6(-1.0_f64..1.0), 0..40)) {
        let points: Vec<SurfacePoint> = cloud
            .into_iter()
            .map(|[x, y, z, a, b, c]| SurfacePoint {
                position: Vector3::new(x, y, z).map(|c| (c * 4.0).round() * 0.01),
                normal: Vector3::new(a, b, c).try_normalize(0.5).unwrap_or_else(Vector3::zeros),
                weight: 1.0,
            })
            .collect();
        if let Ok(fit) = Fit::new(KINDS[kind], &points, &INDEPENDENT) {
            prop_assert!(fit.covariance.iter().all(|c| c.is_finite()) && fit.rms.is_finite());
        }
    }
}

/// Share of the intervals (k = 2) of some figures of an element that hold the truth, over many fits.
fn coverage(trials: u64, fit: impl Fn(u64) -> Fit, figures: impl Fn(&Fit) -> Vec<(Estimate, f64)>) -> f64 {
    let (mut inside, mut all) = (0, 0);
    for seed in 0..trials {
        for (estimate, truth) in figures(&fit(seed)) {
            inside += usize::from((estimate.value - truth).abs() <= estimate.expanded());
            all += 1;
        }
    }
    inside as f64 / all as f64
}

/// Radius, direction and place of an element, each along one line, with the truth.
fn figures(fit: &Fit, truth: &Element) -> Vec<(Estimate, f64)> {
    let mut list = Vec::new();
    list.extend(fit.radius().zip(truth.radius()));
    let deviation = |k: usize| fit.covariance[(k, k)].sqrt();
    let mut add =
        |error: f64, k: usize| list.push((Estimate { value: error, standard_uncertainty: deviation(k) }, 0.0));
    let between = fit.element.middle() - truth.middle();
    match fit.element {
        Element::Plane(Plane { normal, .. }) => {
            // At the middle of its own points: the truth is a plane.
            add(truth.distance(&fit.element.middle()), 0);
            let tilt = truth.direction().map_or(0.0, |t| across(normal).0.dot(&(t - normal)));
            add(tilt, 1);
        }
        Element::Cylinder(Cylinder { axis, .. }) => {
            let axis_of_truth = truth.direction().unwrap_or(axis);
            let off = between - axis_of_truth * axis_of_truth.dot(&between);
            add(across(axis).0.dot(&off), 0);
            add(across(axis).1.dot(&(axis_of_truth * axis.dot(&axis_of_truth).signum() - axis)), 3);
        }
        Element::Sphere(_) => add(between.x, 0),
        Element::Circle(Circle { normal, .. }) => {
            add(across(normal).0.dot(&between), 0);
            add(normal.dot(&between), 2);
        }
    }
    list
}

#[test]
fn stated_intervals_hold_the_truth() {
    for kind in KINDS {
        let here = Isometry3::identity();
        let fit =
            |seed| Fit::new(kind, &points(kind, 60, false, &here, 1000 + seed), &INDEPENDENT).expect("an element");
        let share = coverage(600, fit, |fit| figures(fit, &truth(kind)));
        assert!((0.91..0.98).contains(&share), "{kind:?}: {share}");
    }
}

/// Points in one cube err together: taken for independent ones they promise too much.
#[test]
fn errors_that_are_alike_are_counted_once() {
    const EDGE: f64 = 4e-3;
    let of = |correlation: f64| {
        let errors = SurfaceErrors { correlation, ..INDEPENDENT };
        let fit = move |seed| {
            let mut points = points(ElementKind::Cylinder, 800, false, &Isometry3::identity(), seed);
            for p in &mut points {
                let cube = [0, 1, 2].map(|k| (p.position[k] / EDGE).floor() as i64);
                let number = cube.iter().fold(seed, |n, c| n.wrapping_mul(0x9E37).wrapping_add(*c as u64 & 0xFFFF));
                p.position += p.normal * 2.0 * SIGMA * normal(&mut Pcg64Mcg::seed_from_u64(number));
            }
            Fit::new(ElementKind::Cylinder, &points, &errors).expect("a cylinder")
        };
        coverage(200, fit, |fit| figures(fit, &truth(ElementKind::Cylinder)))
    };
    let (independent, alike) = (of(0.0), of(EDGE));
    assert!(independent < 0.75 && (0.92..=1.0).contains(&alike), "{independent} {alike}");
}

/// An error that all points share moves the radius as far as it is, and the residuals do not show it.
#[test]
fn shared_errors_are_in_the_uncertainty() {
    let errors = SurfaceErrors { surface: 3e-4, ..INDEPENDENT };
    let whole: Vec<SurfacePoint> = (0..400)
        .map(|k| {
            let (sine, cosine) = (f64::from(k) * 2.4).sin_cos();
            let normal = Vector3::new(cosine, sine, 0.0);
            SurfacePoint { position: normal * 0.01 + Vector3::z() * 1e-4 * f64::from(k), normal, weight: 1.0 }
        })
        .collect();
    let fit = Fit::new(ElementKind::Cylinder, &whole, &errors).expect("a cylinder");
    let radius = fit.radius().expect("a radius");
    assert!((radius.standard_uncertainty / 3e-4 - 1.0).abs() < 1e-3 && (radius.value - 0.01).abs() < 1e-9);
    // All around, the middle stays where it is; each of four sides moves the radius by its quarter.
    assert!(fit.covariance[(0, 0)].sqrt() < 1e-5, "{}", fit.covariance[(0, 0)]);
    let posed = Fit::new(ElementKind::Cylinder, &whole, &SurfaceErrors { poses: 3e-4, ..INDEPENDENT });
    let posed = posed.expect("a cylinder").radius().expect("a radius").standard_uncertainty;
    assert!((posed / 1.5e-4 - 1.0).abs() < 0.02, "{posed}");
    // A plane turns with the views that saw it.
    let plane = points(ElementKind::Plane, 400, false, &Isometry3::identity(), 3);
    let turned = Fit::new(ElementKind::Plane, &plane, &SurfaceErrors { turn: 2e-3, ..INDEPENDENT }).expect("a plane");
    // Its normals are noisy.
    assert!((turned.covariance[(1, 1)].sqrt() / 2e-3 - 1.0).abs() < 0.05);
}

#[test]
fn what_is_not_determined_is_refused() {
    let refused = |kind, points: &[SurfacePoint]| Fit::new(kind, points, &INDEPENDENT).expect_err("no element");
    for kind in KINDS {
        assert_eq!(refused(kind, &[]), FitError::TooFewPoints);
        assert_eq!(refused(kind, &points(kind, 3, false, &Isometry3::identity(), 1)), FitError::TooFewPoints);
    }
    let line: Vec<SurfacePoint> = (0..50)
        .map(|k| SurfacePoint {
            position: Vector3::new(1.0, 2.0, 3.0) * 1e-3 * f64::from(k),
            normal: Vector3::z(),
            weight: 1.0,
        })
        .collect();
    assert_eq!(refused(ElementKind::Plane, &line), FitError::Collinear);
    assert_eq!(refused(ElementKind::Circle, &line), FitError::Collinear);
    let flat = points(ElementKind::Plane, 500, false, &Isometry3::identity(), 5);
    for kind in [ElementKind::Cylinder, ElementKind::Sphere] {
        assert_eq!(refused(kind, &flat), FitError::ArcTooShort, "{kind:?}");
    }
    let scattered: Vec<SurfacePoint> = points(ElementKind::Sphere, 300, false, &Isometry3::identity(), 6)
        .into_iter()
        .enumerate()
        .map(|(k, p)| SurfacePoint { position: p.position * (0.2 + (k % 7) as f64 * 0.3), ..p })
        .collect();
    assert_eq!(refused(ElementKind::Plane, &scattered), FitError::NotThisForm);
}

#[test]
fn distances_and_angles_are_those_of_school() {
    let fitted = |element: Element| {
        let covariance = Matrix6::from_diagonal_element(1e-10);
        Feature::Fitted(Fit { element, rms: 0.0, largest: 0.0, used: 100, left_out: 0, covariance })
    };
    let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let tilted = at(0.0, 1.0, 0.02_f64.tan()).normalize();
    let plane = fitted(Element::Plane(Plane { point: at(0.0, 0.0, 0.01), normal: Vector3::z() }));
    let below = fitted(Element::Plane(Plane { point: at(0.5, 0.0, -0.01), normal: -Vector3::z() }));
    let axis = fitted(Element::Cylinder(Cylinder { point: at(0.0, 0.0, 0.0), axis: Vector3::z(), radius: 0.01 }));
    let beside = fitted(Element::Cylinder(Cylinder { point: at(0.03, 0.04, 0.2), axis: -Vector3::z(), radius: 0.01 }));
    let skew = fitted(Element::Cylinder(Cylinder { point: at(0.02, 0.0, 0.1), axis: tilted, radius: 0.01 }));
    let ball = fitted(Element::Sphere(Sphere { centre: at(0.0, 0.03, 0.05), radius: 0.01 }));
    let point = Feature::Point { position: at(0.03, 0.0, 0.05), uncertainty: 1e-4 };
    let metres = |a: &Feature, b: &Feature| distance(a, b).map(|r| r.estimate.value);
    for (a, b, expected) in [
        (&plane, &below, 0.02),
        (&axis, &beside, 0.05),
        (&axis, &skew, 0.02),
        (&ball, &point, 0.03 * 2.0_f64.sqrt()),
        (&axis, &point, 0.03),
        (&plane, &ball, 0.04),
        (&skew, &below, 0.11),
    ] {
        let (there, back) = (metres(a, b).expect("a distance"), metres(b, a).expect("a distance"));
        assert!((there - expected).abs() < 1e-9 && (back - expected).abs() < 1e-3, "{there} {back} for {expected}");
    }
    assert_eq!(metres(&plane, &axis), None, "they meet");
    let degrees = |a: &Feature, b: &Feature| angle(a, b).map(|r| r.estimate.value);
    assert!((degrees(&axis, &skew).expect("an angle") - (FRAC_PI_2 - 0.02)).abs() < 1e-9);
    assert!((degrees(&plane, &axis).expect("an angle") - FRAC_PI_2).abs() < 1e-9);
    assert!((degrees(&skew, &plane).expect("an angle") - 0.02).abs() < 1e-9);
    assert_eq!(degrees(&ball, &plane), None);
    let height = step_height(&plane, &below).expect("a step").estimate;
    assert!((height.value + 0.02).abs() < 1e-12);
    // Half a metre away a turn of 1e-5 lifts by 5e-6 m.
    assert!((height.standard_uncertainty / (2e-10 + 25e-12_f64).sqrt() - 1.0).abs() < 0.01, "{height:?}");
    assert_eq!(step_height(&axis, &below), None);
    // Parallel but for errors: both directions of the error count.
    let parallel = angle(&axis, &beside).expect("an angle").estimate;
    assert!(parallel.value < 1e-12 && (parallel.standard_uncertainty / 2e-5 - 1.0).abs() < 0.01, "{parallel:?}");
}

/// A plate with a boss on it, a millimetre between vertices: heights by place, normals by differences.
fn boss(noise: f64) -> SemanticMesh {
    let mut random = Pcg64Mcg::seed_from_u64(8);
    let n = 60_u32;
    let mut mesh = SemanticMesh::default();
    for (i, j) in (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))) {
        let (x, y) = (f64::from(i) - 30.0, f64::from(j) - 30.0);
        let radius = x.hypot(y);
        let (height, slope) = if radius < 12.0 {
            (5.0, 0.0)
        } else if radius < 14.0 {
            (5.0 - 2.5 * (radius - 12.0), 1.0)
        } else {
            (0.0, 0.0)
        };
        let normal = Vector3::new(slope * x / radius.max(1.0), slope * y / radius.max(1.0), 0.4_f64.max(1.0 - slope));
        let position = [x * 1e-3, y * 1e-3, height * 1e-3 + noise * normal_of(&mut random)].map(|c| c as f32);
        let normal = normal.normalize().map(|c| c as f32).into();
        mesh.push(SemanticPoint { position, normal, label: 1, ..SemanticPoint::UNKNOWN }, false);
    }
    for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
        let a = j * (n + 1) + i;
        mesh.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
    }
    mesh
}

fn normal_of(random: &mut Pcg64Mcg) -> f64 {
    normal(random)
}

#[test]
fn a_region_grows_up_to_the_crease_and_a_step_has_its_height() {
    let mesh = boss(1e-4);
    let regions = MeshRegions::new(&mesh, 1e-3);
    let errors = SurfaceErrors::of_voxels(1e-3);
    let at = |x: i32, y: i32| ((y + 30) * 61 + x + 30) as u32;
    let top = regions.grow(at(2, 3), ElementKind::Plane, &errors).expect("the boss");
    let plate = regions.grow(at(24, -20), ElementKind::Plane, &errors).expect("the plate");
    let inside = |v: &u32| mesh.vertices.positions[*v as usize][2] > 4e-3;
    assert!(top.vertices.iter().all(inside) && (380..480).contains(&top.vertices.len()), "{}", top.vertices.len());
    assert!(!plate.vertices.iter().any(inside) && plate.vertices.len() > 2800, "{}", plate.vertices.len());
    let whole = regions.up_to_creases(at(2, 3));
    assert!(whole.iter().all(inside) && top.vertices.iter().all(|v| whole.binary_search(v).is_ok()));
    let height = step_height(&Feature::Fitted(plate.fit), &Feature::Fitted(top.fit)).expect("a step").estimate;
    assert!((height.value - 5e-3).abs() < height.expanded() && height.expanded() < 0.5e-3, "{height:?}");
    // The upper edge of the boss, picked beside it.
    let rim = regions.grow(at(10, 1), ElementKind::Circle, &errors).expect("a circle");
    let radius = rim.fit.radius().expect("a radius");
    assert!((radius.value - 12e-3).abs() < radius.expanded() && radius.expanded() < 1.2e-3, "{radius:?}");
    assert_eq!(regions.grow(at(2, 3), ElementKind::Sphere, &errors), Err(FitError::ArcTooShort));
    assert!(regions.grow(1_000_000, ElementKind::Plane, &errors).is_err());
}
