//! Recordings (MCAP, ROS 1 bag, SQLite file of ROS 2), any bytes: they may be refused or end early, the reader may not panic, and
//! every view has the sizes that it says.
#![no_main]

use libfuzzer_sys::fuzz_target;
use semascan_inspection::source::Source;
use semascan_sources::OpenOptions;
use semascan_sources::recording::RecordingSource;
use std::io::Write;

fuzz_target!(|bytes: &[u8]| {
    let mut file = tempfile::NamedTempFile::new().expect("a temporary file");
    file.write_all(bytes).expect("room for it");
    let Ok(mut source) = RecordingSource::open(file.path(), OpenOptions::default()) else { return };
    while let Some(view) = source.next_view() {
        if let Ok(view) = view {
            assert_eq!(view.check_sizes(), Ok(()));
        }
    }
});
