//! The live stream over real sockets: every client, however it comes and goes, ends with the same model.

use semascan_inspection::spec::{InspectionSpec, RegistrationMethod};
use semascan_protocol::Phase;
use semascan_tests::client::{Client, Holdings};
use semascan_tests::served::{SMALL_MOTOR, Served};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_from_the_start_and_one_that_comes_late_hold_the_same_model() {
    let served = Served::start().expect("serves");
    let mut early = Holdings::default();
    let mut client = Client::connect(served.address, &mut early).await.expect("connects");
    let inspection = served.inspect(SMALL_MOTOR).expect("begins");
    client.finish(&mut early).await.expect("finishes");
    assert_eq!(client.progress.phase(), Phase::Finished);
    assert_eq!(client.progress.views_done, 5);
    // Each report comes once, whatever happens to the model.
    let views: Vec<u32> = client.views.iter().map(|v| v.index).collect();
    assert_eq!(views, [0, 1, 2, 3, 4]);
    assert!(client.views.iter().all(|v| v.accepted && !v.thumbnail_jpeg.is_empty() && !v.overlay_png.is_empty()));

    let mut late = Holdings::default();
    let mut second = Client::connect(served.address, &mut late).await.expect("connects");
    second.finish(&mut late).await.expect("finishes");
    assert_eq!(early.hash(), late.hash());
    assert_eq!(early.hash(), served.live.hash());
    assert_eq!(client.progress.model_hash, early.hash());

    let inspected = inspection.wait().expect("inspects");
    assert_eq!(early.points(), inspected.cloud.len());
    let t = served.live.totals();
    assert!(t.bytes <= 3 * t.snapshot_bytes, "{} bytes for a snapshot of {}", t.bytes, t.snapshot_bytes);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cut_connection_resumes_by_difference() {
    let served = Served::start().expect("serves");
    // Without refinement there is one epoch: what was held before the cut is still of use.
    let mut spec = InspectionSpec { registration: RegistrationMethod::Kinematic, ..InspectionSpec::default() };
    spec.source.pace_s = 0.2;
    let inspection = served.inspect_with(spec, SMALL_MOTOR).expect("begins");
    let mut holdings = Holdings::default();
    let mut client = Client::connect(served.address, &mut holdings).await.expect("connects");
    while client.progress.views_done < 2 {
        client.step(&mut holdings).await.expect("streams");
    }
    drop(client);
    inspection.wait().expect("inspects");

    let held = holdings.chunks.len() as u64;
    assert!(held > 0);
    let mut again = Client::connect(served.address, &mut holdings).await.expect("connects");
    assert!(again.welcome.resumed);
    again.finish(&mut holdings).await.expect("finishes");
    assert_eq!(holdings.hash(), served.live.hash());

    // With everything held, nothing is sent again.
    let mut whole = Client::connect(served.address, &mut holdings).await.expect("connects");
    whole.finish(&mut holdings).await.expect("finishes");
    assert_eq!(whole.chunk_messages, 0);
    assert_eq!(holdings.hash(), served.live.hash());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_new_inspection_clears_and_ends_with_its_own_model() {
    let served = Served::start().expect("serves");
    let mut holdings = Holdings::default();
    let mut client = Client::connect(served.address, &mut holdings).await.expect("connects");
    served.inspect(SMALL_MOTOR).expect("begins");
    client.finish(&mut holdings).await.expect("finishes");
    let first = holdings.hash();
    let second = served.inspect(&SMALL_MOTOR.replace("seed=7", "seed=8")).expect("begins");
    while holdings.inspection.id != second.id.to_string() {
        client.step(&mut holdings).await.expect("streams");
    }
    assert!(client.clears >= 1);
    client.progress = Default::default();
    client.finish(&mut holdings).await.expect("finishes");
    assert_ne!(holdings.hash(), first);
    assert_eq!(holdings.hash(), served.live.hash());
    assert!(!Client::connect(served.address, &mut Holdings::default()).await.expect("connects").welcome.resumed);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slow_client_skips_revisions_and_still_ends_with_the_model() {
    let served = Served::start().expect("serves");
    let (mut fast_holdings, mut slow_holdings) = (Holdings::default(), Holdings::default());
    let mut fast = Client::connect(served.address, &mut fast_holdings).await.expect("connects");
    let mut slow = Client::connect(served.address, &mut slow_holdings).await.expect("connects");
    let inspection = served.inspect(SMALL_MOTOR).expect("begins");
    // The slow one does not read at all until the inspection is over.
    fast.finish(&mut fast_holdings).await.expect("finishes");
    inspection.wait().expect("inspects");
    slow.finish(&mut slow_holdings).await.expect("finishes");
    assert_eq!(slow_holdings.hash(), fast_holdings.hash());
    assert!(slow.chunk_messages <= fast.chunk_messages);
}
