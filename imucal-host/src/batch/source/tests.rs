use std::fs;

use imucal_core::record::Date;

use super::*;
use crate::{calibrate::request::Request, file::Limits, recording::Mapping};

fn method() -> Method {
    Method {
        request: Request::default(),
        mapping: Mapping::default(),
        limits: Limits::default(),
        date: Date::from_days(20_000),
    }
}

/// A folder with these empty files; those in folders too.
fn folder(names: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in names {
        write(&folder, name, "");
    }
    folder
}

fn write(folder: &tempfile::TempDir, name: &str, content: &str) {
    let path = folder.path().join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, content).unwrap();
}

/// What is found from sources within a folder.
fn names(folder: &tempfile::TempDir, from: &[&str], excluded: &[&str]) -> Result<Vec<String>, SourceFault> {
    let within = |names: &[&str]| names.iter().map(|name| folder.path().join(name)).collect::<Vec<_>>();
    let found = find(&within(from), &within(excluded), &method())?;
    Ok(found.into_iter().map(|source| source.name).collect())
}

#[test]
fn a_folder_gives_all_its_recordings_in_order_and_nothing_else() {
    let files =
        ["b/x.csv", "a/x.csv", "a/x.toml", "z.csv.gz", "m.PARQUET", "notes.txt", ".hidden/h.csv", "a/.h.csv"];
    let folder = folder(&files);
    assert_eq!(names(&folder, &[""], &[]).unwrap(), ["a/x", "b/x", "m", "z"]);
}

#[test]
fn outputs_within_the_folder_are_not_taken_for_recordings() {
    let folder = folder(&["x.csv", "out/summary.csv", "table.csv"]);
    assert_eq!(names(&folder, &[""], &["out", "table.csv"]).unwrap(), ["x"]);
    // Outputs into the folder above, or into the recordings' own, exclude none of them.
    assert_eq!(names(&folder, &["out"], &[""]).unwrap(), ["summary"]);
    assert_eq!(names(&folder, &["out"], &["out"]).unwrap(), ["summary"]);
}

#[test]
fn a_pattern_and_the_files_that_a_shell_makes_of_it_give_the_same() {
    let folder = folder(&["day1/a.csv", "day1/b.csv", "day1/c.csv.gz", "day2/a.csv"]);
    let from_pattern = names(&folder, &["day1/*.csv"], &[]).unwrap();
    assert_eq!(from_pattern, ["a", "b"]);
    assert_eq!(names(&folder, &["day1/b.csv", "day1/a.csv"], &[]).unwrap(), from_pattern);
    assert_eq!(names(&folder, &["*/a.csv"], &[]).unwrap(), ["day1/a", "day2/a"]);
    assert_eq!(
        names(&folder, &["**/*.csv*", "day1"], &[]).unwrap(),
        ["day1/a", "day1/b", "day1/c", "day2/a"]
    );
}

#[test]
fn recordings_that_differ_by_their_ending_alone_keep_it_in_their_name() {
    let folder = folder(&["x.csv", "x.csv.gz", "y.csv"]);
    assert_eq!(names(&folder, &[""], &[]).unwrap(), ["x.csv", "x.csv.gz", "y"]);
}

#[test]
fn lists_as_toml_and_as_csv_say_the_same() {
    let folder = folder(&["a/x.csv", "b/x.csv", "b/y.csv"]);
    let rows = "path,name,model\na/x.csv,board 7,\"acc=T6,mag=E9\"\nb/x.csv,,\nb/none.csv,,\n";
    write(&folder, "list.csv", rows);
    let toml = "format = \"imucal-batch/1\"\n\
        [[recording]]\npath = \"a/x.csv\"\nname = \"board 7\"\nmodel = \"acc=T6,mag=E9\"\n\
        [[recording]]\npath = \"b/x.csv\"\n[[recording]]\npath = \"b/none.csv\"\n";
    write(&folder, "list.toml", toml);
    for list in ["list.csv", "list.toml"] {
        let found = find(&[folder.path().join(list)], &[], &method()).unwrap();
        let found: Vec<_> = found
            .iter()
            .map(|source| (source.name.as_str(), source.from_root.as_str(), source.method.options()))
            .collect();
        // A recording that is not there is listed; what becomes of it is found when it is read.
        assert_eq!(found.iter().map(|found| found.0).collect::<Vec<_>>(), ["b/none", "b/x", "board 7"]);
        assert_eq!(found[2].1, "a/x.csv");
        assert_eq!(found[1].2, method().options());
        assert!(found[2].2.contains("T6") && found[2].2 != found[1].2);
    }
}

#[test]
fn a_recording_that_is_found_with_two_methods_is_named_twice() {
    let folder = folder(&["in/x.csv"]);
    write(&folder, "list.csv", "path,model\nin/x.csv,acc=T6\n");
    let found = |from: &[&str]| {
        let from: Vec<_> = from.iter().map(|name| folder.path().join(name)).collect();
        find(&from, &[], &method()).map(|found| found.len())
    };
    assert!(matches!(found(&["in", "list.csv"]), Err(SourceFault::Twice { .. })));
    assert!(matches!((found(&["in", "in/x.csv"]), found(&["list.csv"])), (Ok(1), Ok(1))));
    write(&folder, "list.csv", "path,name,model\nin/x.csv,six,acc=T6\nin/x.csv,nine,\n");
    assert!(matches!(found(&["list.csv"]), Ok(2)));
}

#[test]
fn a_bag_of_several_files_is_one_recording() {
    let folder = folder(&["in/walk/walk_0.mcap", "in/walk/walk_1.mcap", "in/x.csv"]);
    write(&folder, "in/walk/metadata.yaml", "rosbag2_bagfile_information:\n");
    // Another program's.
    write(&folder, "in/metadata.yaml", "dataset: walks\n");
    for from in ["in", "in/*"] {
        assert_eq!(names(&folder, &[from], &[]).unwrap(), ["walk", "x"], "{from}");
    }
    assert_eq!(names(&folder, &["in/walk"], &[]).unwrap(), ["walk"]);
}

#[test]
fn a_list_has_topics_for_each_log() {
    let folder = folder(&["a.mcap", "b.db3", "c.bag"]);
    let rows = "path,topic\na.mcap,imu=/imu/data; mag=none\nb.db3,imu=/head\nc.bag,\n";
    write(&folder, "list.csv", rows);
    let toml = "format = \"imucal-batch/1\"\n\
        [[recording]]\npath = \"a.mcap\"\ntopic = \"imu=/imu/data;mag=none\"\n\
        [[recording]]\npath = \"b.db3\"\ntopic = \"imu=/head\"\n[[recording]]\npath = \"c.bag\"\n";
    write(&folder, "list.toml", toml);
    let with = |topics: &[&str]| {
        let topics: Vec<String> = topics.iter().map(|topic| (*topic).to_owned()).collect();
        Method { mapping: Mapping::default().with_topics(&topics).unwrap(), ..method() }.options()
    };
    for list in ["list.csv", "list.toml"] {
        let found = find(&[folder.path().join(list)], &[], &method()).unwrap();
        let options: Vec<String> = found.iter().map(|source| source.method.options()).collect();
        let expected = [with(&["imu=/imu/data", "mag=none"]), with(&["imu=/head"]), method().options()];
        assert_eq!(options, expected, "{list}");
    }
    write(&folder, "bad.csv", "path,topic\na.mcap,/imu/data\n");
    let message = names(&folder, &["bad.csv"], &[]).unwrap_err().to_string();
    assert!(message.contains("a.mcap") && message.contains("imu=/imu/data"), "{message}");
}

#[test]
fn what_cannot_be_understood_is_named_with_what_to_do() {
    let folder = folder(&["empty/notes.txt", "x.csv", "other.txt"]);
    write(&folder, "run.toml", "format = \"imucal-recording/1\"\n");
    write(&folder, "bad.toml", "format = \"imucal-batch/1\"\n[[recording]]\npath = \"x.csv\"\ncolour = 1\n");
    write(&folder, "model.csv", "path,model\nx.csv,acc=T7\n");
    write(&folder, "name.csv", "path,name\nx.csv,../y\n");
    write(&folder, "twice.csv", "path,name\nx.csv,y\nz.csv,y\n");
    for (from, parts) in [
        ("none.csv", &["no such file"][..]),
        ("none/*.csv", &["no recording"]),
        ("empty", &["no recording"]),
        ("other.txt", &["neither a recording nor a list"]),
        ("run.toml", &["the manifest of a recording"]),
        ("bad.toml", &["colour", "path, name, model, map, unit, time, topic"]),
        ("model.csv", &["x.csv", "`acc=T7` is no model"]),
        ("name.csv", &["`../y`", "change it in the list"]),
        ("twice.csv", &["`y`", "x.csv", "z.csv", "in a list"]),
        ("a[", &["cannot be understood", "in quotes"]),
    ] {
        let message = names(&folder, &[from], &[]).expect_err(from).to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{from}: {message}");
    }
}
