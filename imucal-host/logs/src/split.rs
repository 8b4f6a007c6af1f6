//! A ROS 2 bag is a folder: `metadata.yaml`, and the files that the recorder split it into. Source: ros2/rosbag2,
//! `rosbag2_storage/metadata_io.cpp`.

use std::{
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
};

use yaml_rust2::parser::{Event, Parser};

use crate::error::LogError;

/// What lists the files.
const METADATA: &str = "metadata.yaml";
/// What it begins with, after comments.
const OWN: &[u8] = b"rosbag2_bagfile_information";
/// Bytes of it by which it is known.
const BEGINNING: u64 = 4096;
/// Bytes of it that are read: a line for each file and each topic.
const LONGEST: u64 = 1 << 22;

/// Whether a path is a folder that the recorder of ROS 2 made. Other programs write a file of this name, too.
#[must_use]
pub fn is_bag_folder(path: &Path) -> bool {
    let mut beginning = Vec::new();
    let file = File::open(path.join(METADATA));
    let read = file.and_then(|file| file.take(BEGINNING).read_to_end(&mut beginning));
    read.is_ok() && beginning.windows(OWN.len()).any(|part| part == OWN)
}

/// The files of a log in their order: those that the bag's metadata list, or the file itself.
///
/// # Errors
///
/// [`LogError`] of metadata that cannot be understood, and of files that the recorder compressed as a whole.
pub fn files_of(path: &Path) -> Result<Vec<PathBuf>, LogError> {
    if !is_bag_folder(path) {
        return Ok(vec![path.to_path_buf()]);
    }
    let metadata = path.join(METADATA);
    let unreadable = |found: String| LogError::Unreadable { path: metadata.clone(), found };
    let length = fs::metadata(&metadata).map_err(|cause| unreadable(cause.to_string()))?.len();
    let text = match length {
        length if length > LONGEST => return Err(unreadable(format!("{length} bytes"))),
        _ => fs::read_to_string(&metadata).map_err(|cause| unreadable(cause.to_string()))?,
    };
    let names = names(&text).map_err(|found| LogError::Metadata { path: metadata, found })?;
    // Up to format 2 they stood behind the folder's name.
    let file = |name: &String| Some(path.join(Path::new(name).file_name()?));
    let files: Vec<PathBuf> = names.iter().filter_map(file).collect();
    match files.iter().find(|file| file.extension().is_some_and(|ending| ending == "zstd")) {
        Some(packed) => Err(LogError::Packed { path: packed.clone() }),
        None => Ok(files),
    }
}

/// The names that the metadata list, or what they have in their place. Event by event, so that neither depth nor repetition
/// takes memory.
fn names(text: &str) -> Result<Vec<String>, String> {
    let mut parser = Parser::new_from_str(text);
    let mut next = || parser.next_token().map(|(event, _)| event).map_err(|fault| fault.to_string());
    loop {
        match next()? {
            Event::Scalar(key, ..) if key == "relative_file_paths" => break,
            Event::StreamEnd => return Err("no relative_file_paths".to_owned()),
            _ => (),
        }
    }
    let mut names = Vec::new();
    if let Event::SequenceStart(..) = next()? {
        while let Event::Scalar(name, ..) = next()? {
            names.push(name);
        }
    }
    if names.is_empty() { Err("no names of files".to_owned()) } else { Ok(names) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(metadata: &str) -> Result<Vec<String>, String> {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(METADATA), metadata).unwrap();
        let files = files_of(folder.path()).map_err(|error| error.to_string())?;
        Ok(files.iter().map(|file| file.file_name().unwrap().to_str().unwrap().to_owned()).collect())
    }

    #[test]
    fn the_files_are_those_of_the_metadata_in_their_order() {
        let metadata = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - walk_9.mcap\n    \
                        - walk_10.mcap\n  message_count: 3\n";
        assert_eq!(files(metadata).unwrap(), ["walk_9.mcap", "walk_10.mcap"]);
        let old = "rosbag2_bagfile_information: {relative_file_paths: [walk/walk_0.db3]}\n";
        assert_eq!(files(old).unwrap(), ["walk_0.db3"]);
    }

    #[test]
    fn metadata_of_any_depth_end_in_an_error() {
        for part in ["[", "{a: ", "- ", "a:\n  "] {
            let deep = format!("rosbag2_bagfile_information: {}", part.repeat(100_000));
            assert!(files(&deep).is_err(), "{part}");
        }
    }

    #[test]
    fn metadata_of_another_program_make_no_bag() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_bag_folder(folder.path()));
        fs::write(folder.path().join(METADATA), "dataset: {name: walk, rate: 100}\n").unwrap();
        assert!(!is_bag_folder(folder.path()));
        assert_eq!(files_of(folder.path()).unwrap(), [folder.path()]);
    }

    #[test]
    fn a_file_is_its_own_only_one() {
        let path = Path::new("no/such.mcap");
        assert_eq!(files_of(path).unwrap(), [path]);
    }

    #[test]
    fn metadata_that_cannot_be_understood_are_refused_and_so_are_packed_files() {
        for (metadata, found) in [
            ("rosbag2_bagfile_information:", "no relative_file_paths"),
            ("rosbag2_bagfile_information: [", "while"),
            ("rosbag2_bagfile_information: {relative_file_paths: []}", "no names of files"),
            ("rosbag2_bagfile_information: {relative_file_paths: [[1]]}", "no names of files"),
            ("rosbag2_bagfile_information: {relative_file_paths: [a_0.db3.zstd]}", "zstd -d"),
        ] {
            let error = files(metadata).unwrap_err();
            assert!(error.contains(found), "{metadata}: {error}");
        }
    }
}
