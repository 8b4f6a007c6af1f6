//! No bytes make the reader panic, or take memory that nothing stands for.

use std::{fs, path::Path};

use imucal_logs::Log;
use proptest::prelude::*;

const FIXTURES: [&str; 8] = [
    "ros2-none.mcap",
    "ros2-lz4.mcap",
    "ros2-zstd.mcap",
    "none.bag",
    "bz2.bag",
    "lz4.bag",
    "iron.db3",
    "compressed.db3",
];

/// Reads whatever can be read of a file.
fn read_all(path: &Path) {
    let Ok(log) = Log::open(path, 1 << 20) else { return };
    let names: Vec<&str> =
        log.topics().iter().filter(|topic| topic.kind.is_ok()).map(|topic| topic.name.as_str()).collect();
    for name in &names {
        let _ = log.read(&[name]);
    }
    if let Ok(reading) = log.read(&names) {
        for stream in reading.streams {
            assert!(stream.stamps_ns.windows(2).all(|pair| pair[0] < pair[1]));
            assert_eq!(stream.values.len(), stream.stamps_ns.len() * stream.kind.columns().len());
        }
    }
}

proptest! {
    #[test]
    fn a_mutated_log_is_read_or_refused(
        which in 0..FIXTURES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
        is_cut: bool,
    ) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(FIXTURES[which]);
        let mut bytes = fs::read(path).expect("a fixture");
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if is_cut {
            bytes.truncate(cut.index(bytes.len()));
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        fs::write(&path, bytes).expect("room");
        read_all(&path);
    }

    /// The first bytes are those of a log, and nothing else is.
    #[test]
    fn noise_behind_a_magic_is_read_or_refused(which in 0..3usize, noise in prop::collection::vec(any::<u8>(), 0..400)) {
        let magic: &[u8] = [&b"#ROSBAG V2.0\n"[..], b"\x89MCAP0\r\n", b"SQLite format 3\0"][which];
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        fs::write(&path, [magic, &noise].concat()).expect("room");
        read_all(&path);
    }
}
