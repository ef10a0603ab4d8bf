//! A hostile agent against everything that a message passes on its way into the page: the session that decodes it, the block
//! in which it crosses from the worker, the state and the model. Nothing may panic, and however much is sent, what is held
//! stays within bounds, which the memory of this process shows.

use prost::Message as _;
use rand::{Rng, RngExt, SeedableRng};
use semascan_model::{PointFlags, SemanticPoint};
use semascan_protocol::chunk::{ChunkEncoder, VoxelChunk, encode};
use semascan_protocol::server_message::Body;
use semascan_protocol::{
    ChunkGone, ChunkId, ChunkUpdate, ClassDef, Clear, Inspection, MAX_ENTRIES, MAX_SERVER_MESSAGE, Phase, Progress,
    ServerMessage, StageEvent, ViewReport, Welcome,
};
use semascan_viewer::link::session::Session;
use semascan_viewer::link::{LinkEvent, transfer};
use semascan_viewer::scene::HeldModel;
use semascan_viewer::state::views::Views;
use semascan_viewer::state::{AppState, Event};

/// Memory that a whole page may take for a model, bytes; while one is exchanged for the next it holds two.
const MOST_OF_A_MODEL: u64 = 1_200_000_000;
/// Memory beside the models, bytes.
const REST: u64 = 300_000_000;

/// The viewer without a browser.
struct Page {
    session: Session,
    state: AppState,
    model: HeldModel,
    left_out: usize,
    malformed: usize,
}

impl Page {
    /// A page that follows inspection `id`.
    fn following(id: &str) -> Self {
        let mut page = Self {
            session: Session::within(MOST_OF_A_MODEL),
            state: AppState::default(),
            model: HeldModel::new(),
            left_out: 0,
            malformed: 0,
        };
        page.receive(Body::Welcome(Welcome { inspection: Some(inspection(id, 1)), ..Welcome::default() }));
        page
    }

    fn receive(&mut self, body: Body) {
        self.receive_bytes(&ServerMessage { body: Some(body) }.encode_to_vec());
    }

    fn receive_bytes(&mut self, message: &[u8]) {
        let event = self.session.receive(message);
        if let Some(halvings) = self.session.take_halvings() {
            self.follow(&LinkEvent::Halved { halvings }, &[]);
        }
        if let Some(event) = event {
            self.follow(&event, message);
        }
    }

    fn follow(&mut self, event: &LinkEvent, message: &[u8]) {
        let block = transfer::encode(event, message);
        let event = transfer::decode(&block).expect("the worker sends what the page can read");
        self.left_out += usize::from(matches!(event, LinkEvent::LeftOut { .. }));
        self.malformed += usize::from(matches!(event, LinkEvent::Malformed { .. }));
        self.model.apply(&event);
        self.state.reduce(&Event::Link(Box::new(event)));
    }

    /// It still works: an honest agent's model arrives.
    fn recovers(&mut self) {
        self.receive(Body::Clear(Clear { inspection: Some(inspection("honest", 1)), successor: false }));
        self.receive(Body::Chunk(chunk([1, 2, 3], 1, 1)));
        assert_eq!((self.model.chunk_count(), self.model.point_count()), (1, 1));
        assert!(!self.state.is_cut && self.state.halvings == 0, "nothing is left out any more");
    }
}

fn inspection(id: &str, epoch: u32) -> Inspection {
    Inspection { id: id.into(), epoch, voxel: 0.001, ..Inspection::default() }
}

fn point(position: [f32; 3]) -> SemanticPoint {
    SemanticPoint {
        position,
        normal: [0.0, 0.0, 1.0],
        color: [200, 100, 50],
        label: 1,
        confidence: 0.9,
        defect: 0,
        defect_confidence: 0.0,
        sigma: 0.1,
        defect_sigma: 0.0,
        instance: 0,
        views: 2,
        flags: PointFlags::default(),
    }
}

/// `count` voxels at chunk `id`, filled from its corner.
fn voxels(id: [i32; 3], count: usize) -> VoxelChunk {
    let voxel = 0.001_f32;
    let at = |cell: [u8; 3], axis: usize| (id[axis] as f32 * 32.0 + f32::from(cell[axis]) + 0.5) * voxel;
    let cell = |i: usize| [(i % 32) as u8, (i / 32 % 32) as u8, (i / 1024) as u8];
    let voxels = (0..count).map(|i| (cell(i), point([at(cell(i), 0), at(cell(i), 1), at(cell(i), 2)]))).collect();
    VoxelChunk { id, voxel, voxels }
}

/// The same as a message.
fn filled(id: [i32; 3], count: usize, revision: u32) -> ChunkUpdate {
    encode(&voxels(id, count), 1, revision).expect("a sound chunk").update
}

fn chunk(id: [i32; 3], epoch: u32, revision: u32) -> ChunkUpdate {
    ChunkUpdate { epoch, revision, ..filled(id, 1, revision) }
}

/// Resident memory of this process now, bytes; `None` where the system does not say it.
fn resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches(" kB").parse::<u64>().ok().map(|kilobytes| kilobytes << 10)
}

/// Asserts that no more than `most` bytes came on top of `before`, and prints how many did.
fn assert_grown(what: &str, before: Option<u64>, most: u64) {
    let (Some(before), Some(now)) = (before, resident()) else { return };
    let grown = now.saturating_sub(before);
    eprintln!("{what}: {} MB more", grown / 1_000_000);
    assert!(grown < most, "{what}: {grown} bytes more than before");
}

#[test]
fn whatever_an_agent_sends_the_page_stays_within_its_memory() {
    let mut encoder = ChunkEncoder::default();
    let single = |k: i32| encoder.encode(&voxels([k % 1000, k / 1000, 7], 1), 1, 1).expect("a sound chunk").update;
    let singles: Vec<ChunkUpdate> = (0..SINGLES).map(single).collect();
    endless_chunks_of_one_point(&singles);
    endless_full_chunks();
    epochs_that_never_end(&singles);
    endless_pictures();
}

/// Chunks of one point: half as many again as a page holds.
const SINGLES: i32 = 60_000;

/// 21 MB of these once filled 6.5 GB of a browser's memory.
fn endless_chunks_of_one_point(singles: &[ChunkUpdate]) {
    let (before, mut page) = (resident(), Page::following("a"));
    let mut sent = 0;
    for single in singles {
        let message = ServerMessage { body: Some(Body::Chunk(single.clone())) }.encode_to_vec();
        sent += message.len();
        page.receive_bytes(&message);
    }
    // A chunk of one point takes 30 kB of a browser's memory.
    let most = MOST_OF_A_MODEL / 30_000;
    assert!(page.model.chunk_count() as u64 <= most, "{} chunks are held", page.model.chunk_count());
    assert!(page.model.chunk_count() > 30_000, "what fits is shown");
    assert!(page.state.is_cut && page.left_out == 1, "it is said, once: {}", page.left_out);
    let held = page.model.chunk_count();
    assert_grown(&format!("{sent} bytes of single points, {held} of {SINGLES} chunks held"), before, REST);
    page.recovers();
}

fn endless_full_chunks() {
    let (before, mut page) = (resident(), Page::following("a"));
    let mut encoder = ChunkEncoder::default();
    let mut sent = 0;
    for k in 0..450 {
        let update = encoder.encode(&voxels([k, 0, 0], 32 * 32 * 32), 1, 1).expect("a sound chunk").update;
        sent += update.columns.len();
        page.receive(Body::Chunk(update));
    }
    let points = page.model.point_count();
    assert!(points > 5_000_000 && points < 40_000_000, "{points} points");
    assert!(page.state.halvings > 0 && !page.state.is_cut, "every chunk is shown, thinner");
    assert_eq!(page.model.chunk_count(), 450);
    assert_grown(&format!("{sent} bytes of full chunks, {points} points held"), before, MOST_OF_A_MODEL + REST);
    page.recovers();
}

/// Each announces a successor, so that the page goes on showing the model before, and never completes it.
fn epochs_that_never_end(singles: &[ChunkUpdate]) {
    let (before, mut page) = (resident(), Page::following("a"));
    for epoch in 1..4 {
        let successor = Some(inspection("a", epoch));
        page.receive(Body::Clear(Clear { inspection: successor, successor: true }));
        for single in singles {
            page.receive(Body::Chunk(ChunkUpdate { epoch, ..single.clone() }));
        }
    }
    assert!(page.model.chunk_count() as u64 <= MOST_OF_A_MODEL / 30_000);
    assert_grown("three epochs that never end", before, REST);
    page.recovers();
}

fn endless_pictures() {
    let (before, mut page) = (resident(), Page::following("a"));
    for index in 0..300 {
        let picture = vec![index as u8; 2 << 20];
        page.receive(Body::View(ViewReport {
            index,
            reason: "x".repeat(1 << 20),
            thumbnail_jpeg: picture.clone(),
            overlay_png: picture,
            ..ViewReport::default()
        }));
    }
    let kept = page.state.views.picture_bytes();
    assert!(kept > Views::MAX_PICTURE_BYTES / 2 && kept <= Views::MAX_PICTURE_BYTES, "{kept} bytes");
    assert_eq!(page.state.views.iter().len(), 300, "what is known of them stays");
    assert!(page.state.views.get(0).is_some_and(|v| v.pictures_dropped && v.thumbnail_jpeg.is_empty()));
    assert!(page.state.views.get(299).is_some_and(|v| !v.pictures_dropped && v.reason.len() <= 1000));
    assert_grown("1.5 GB of pictures and reasons", before, REST);
    page.recovers();
}

#[test]
fn absurd_numbers_are_refused_or_harmless() {
    let mut page = Page::following("a");
    let good = chunk([0; 3], 1, 1);
    let absurd = [
        ChunkUpdate { points: u32::MAX, ..good.clone() },
        ChunkUpdate { points: 0, ..good.clone() },
        ChunkUpdate { scale: f32::NAN, ..good.clone() },
        ChunkUpdate { scale: f32::INFINITY, ..good.clone() },
        ChunkUpdate { scale: -1.0, ..good.clone() },
        ChunkUpdate { origin_x: f32::NAN, ..good.clone() },
        ChunkUpdate { origin_z: f32::NEG_INFINITY, ..good.clone() },
        ChunkUpdate { id: None, ..good.clone() },
        ChunkUpdate { id: Some(ChunkId { x: i32::MAX, y: i32::MIN, z: 0 }), ..good.clone() },
        ChunkUpdate { columns: Vec::new().into(), ..good.clone() },
        ChunkUpdate { columns: vec![0; MAX_SERVER_MESSAGE - 100].into(), ..good.clone() },
    ];
    let refused = absurd.len();
    absurd.into_iter().for_each(|update| page.receive(Body::Chunk(update)));
    assert_eq!((page.malformed, page.model.chunk_count()), (refused, 0));
    // Of other epochs, and of chunks that are not there.
    page.receive(Body::Chunk(ChunkUpdate { epoch: 0, ..good.clone() }));
    page.receive(Body::Chunk(ChunkUpdate { epoch: u32::MAX, ..good.clone() }));
    page.receive(Body::Gone(ChunkGone { epoch: 1, id: Some(ChunkId { x: 5, y: 5, z: 5 }), revision: u32::MAX }));
    assert_eq!((page.malformed, page.model.chunk_count()), (refused, 0));
    // A resumption of what was never held.
    page.receive(Body::Welcome(Welcome {
        inspection: Some(inspection("other", 9)),
        resumed: true,
        ..Welcome::default()
    }));
    assert_eq!(page.malformed, refused + 1);
    // Two bytes of a message that stand for a class of forty.
    let many = Inspection { components: vec![ClassDef::default(); MAX_ENTRIES + 1], ..inspection("a", 1) };
    page.receive(Body::Clear(Clear { inspection: Some(many), successor: false }));
    page.receive_bytes(&vec![0; MAX_SERVER_MESSAGE + 1]);
    page.receive_bytes(&[]);
    assert_eq!(page.malformed, refused + 4);
    for voxel in [f64::NAN, f64::INFINITY, -1.0, 1e300, 0.0] {
        let inspection = Inspection { voxel, views_expected: u32::MAX, ..inspection("a", 1) };
        page.receive(Body::Clear(Clear { inspection: Some(inspection), successor: false }));
    }
    for phase in [Phase::Running, Phase::Finished, Phase::Failed, Phase::Running] {
        page.receive(Body::Progress(Progress {
            phase: phase.into(),
            views_done: u32::MAX,
            views_rejected: u32::MAX,
            views_expected: 1,
            points: u64::MAX,
            chunks: u32::MAX,
            complete_epoch: u32::MAX,
            ..Progress::default()
        }));
        page.receive(Body::Stage(StageEvent {
            view: u32::MAX,
            stage: 99,
            state: 99,
            duration_us: u64::MAX,
            ..StageEvent::default()
        }));
        page.receive(Body::View(ViewReport { index: u32::MAX, points_added: u64::MAX, ..ViewReport::default() }));
        assert!(!page.state.status().is_empty());
    }
    page.recovers();
}

#[test]
fn mutated_messages_never_panic() {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(14);
    let mut page = Page::following("a");
    let mut sources: Vec<Vec<u8>> = Vec::new();
    for count in [1, 7, 300, 5000] {
        sources.push(ServerMessage { body: Some(Body::Chunk(filled([0, 1, 2], count, 1))) }.encode_to_vec());
    }
    let report = ViewReport { index: 3, reason: "why".into(), thumbnail_jpeg: vec![9; 50], ..ViewReport::default() };
    let classes = vec![ClassDef { id: 1, name: "gear".into(), color: 0xff_00_00 }; 3];
    let next = Inspection { components: classes, ..inspection("a", 2) };
    for body in [
        Body::View(report),
        Body::Clear(Clear { inspection: Some(next.clone()), successor: true }),
        Body::Welcome(Welcome { inspection: Some(next), resumed: false, ..Welcome::default() }),
        Body::Progress(Progress { phase: Phase::Running.into(), points: 7, ..Progress::default() }),
        Body::Gone(ChunkGone { epoch: 1, id: Some(ChunkId { x: 0, y: 1, z: 2 }), revision: 4 }),
    ] {
        sources.push(ServerMessage { body: Some(body) }.encode_to_vec());
    }
    const MUTATIONS: usize = 20_000;
    for _ in 0..MUTATIONS {
        let mut message = sources[rng.random_range(0..sources.len())].clone();
        for _ in 0..rng.random_range(1..6) {
            let at = rng.random_range(0..message.len());
            match rng.random_range(0..4) {
                0 => message[at] = rng.next_u32() as u8,
                1 => message[at] ^= 1 << rng.random_range(0..8),
                2 => message.truncate(at.max(1)),
                _ => message.insert(at, rng.next_u32() as u8),
            }
        }
        page.receive_bytes(&message);
    }
    assert!(page.malformed > MUTATIONS / 4, "{} of {MUTATIONS} were refused", page.malformed);
    eprintln!("{MUTATIONS} mutated messages: {} refused, {} chunks held", page.malformed, page.model.chunk_count());
    page.recovers();
}
