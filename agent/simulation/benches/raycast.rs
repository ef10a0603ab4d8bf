//! Time to cast rays at a starter motor and to render one view of the virtual cell.

use criterion::{Criterion, criterion_group, criterion_main};
use semascan_geometry::measure::SurfaceIndex;
use semascan_inspection::source::Source;
use semascan_simulation::raycast::RayScene;
use semascan_simulation::{VirtualCell, VirtualCellSpec};

fn raycast(c: &mut Criterion) {
    let spec = VirtualCellSpec::parse("virtual:starter-motor?seed=7&views=12&size=640x480").expect("a valid URI");
    let cell = VirtualCell::open(&spec).expect("a motor needs no file");
    let mesh = cell.truth().expect("the cell knows the truth");
    let scene = RayScene::new(&mesh.vertices, &mesh.triangles);
    let index = SurfaceIndex::new(&mesh.vertices, &mesh.triangles);
    let mut group = c.benchmark_group("virtual cell");
    group.sample_size(10);
    group.bench_function("view 640x480", |b| b.iter(|| cell.view(3)));
    group.bench_function("100 k primary rays, one thread", |b| {
        b.iter(|| {
            let target = |i: u32| glam::Vec3::new((i % 400) as f32 * 5e-4 - 0.1, 0.0, (i / 400) as f32 * 1e-3);
            let eye = glam::Vec3::new(0.1, 0.5, 0.2);
            (0..100_000).filter(|&i| scene.first_hit(eye, target(i) - eye).is_some()).count()
        });
    });
    group.bench_function("100 k nearest points, one thread", |b| {
        b.iter(|| {
            let point = |i: u32| [(i % 400) as f32 * 5e-4 - 0.1, 0.02, (i / 400) as f32 * 1e-3];
            (0..100_000).filter_map(|i| index.closest(point(i))).map(|n| f64::from(n.distance)).sum::<f64>()
        });
    });
    group.finish();
}

criterion_group!(benches, raycast);
criterion_main!(benches);
