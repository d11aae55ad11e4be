//! Snapshots and recordings as files.

use crate::browser::decode;
use crate::{refused, succeeds};

#[test]
fn a_snapshot_is_svg_or_png_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let args = ["snapshot", "stack:4", "--step", "30", "--solver", "pgs", "--set", "baumgarte=0.2", "-o"];
    let text = succeeds(path, &[&args[..], &["a.svg"]].concat());
    assert!(text.contains("stack:4") && text.contains("step 30") && text.contains("baumgarte 0.2"), "{text}");
    succeeds(path, &[&args[..], &["a.png", "--width", "500"]].concat());
    let svg = std::fs::read_to_string(path.join("a.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("body 4, deepest overlap") && svg.contains("N·s"));
    let png = std::fs::read(path.join("a.png")).unwrap();
    assert_eq!(&png[..8], b"\x89PNG\r\n\x1a\n");
    assert_eq!(png[16..20], 500_u32.to_be_bytes());
    refused(path, &["snapshot", "stack:4", "-o", "a.gif"], &["a.gif", ".svg", ".png"]);
    refused(path, &["snapshot", "stack:4", "-o", "b.png", "--width", "9"], &["width", "9", "400"]);
    refused(path, &["snapshot", "staack", "-o", "b.svg"], &["'staack'", "'stack'"]);
    refused(path, &["snapshot", "stack:4", "-o", "b.svg", "--lanes", "3"], &["lanes", "3"]);
    refused(path, &["snapshot", "stack:4", "-o", "b.svg", "--scale", "0mm"], &["--scale", "0mm"]);
    // All pictures have the same scale: micrometers are invisible unless a scale of micrometers is requested.
    let colors = |options: &[&str]| {
        succeeds(path, &[&["snapshot", "stack:2", "--without", "statics", "-o", "c.svg"], options].concat());
        let text = std::fs::read_to_string(path.join("c.svg")).unwrap();
        let bodies = text.lines().filter(|line| line.contains("<title>body"));
        let fill = |line: &str| Some(line.split_once("fill=\"")?.1[..7].to_string());
        bodies.filter_map(fill).collect::<Vec<String>>()
    };
    let (coarse, fine) = (colors(&[]), colors(&["--scale", "5um"]));
    assert!(coarse[1..].iter().all(|color| *color == coarse[1]) && fine[1..] != coarse[1..], "{fine:?}");
}

#[test]
fn the_same_frame_is_the_same_file_at_every_width() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for lanes in ["1", "8"] {
        let name = format!("{lanes}.png");
        succeeds(path, &["snapshot", "arch", "--step", "20", "--lanes", lanes, "-o", &name]);
    }
    let pictures = ["1.png", "8.png"].map(|n| decode(&std::fs::read(path.join(n)).unwrap()));
    // The line above the scene names the lanes, so it is cut off.
    let [a, b] = pictures.map(|([width, _], pixels)| pixels[66 * width..].to_vec());
    assert!(a.len() > 100_000 && a == b);
}

#[test]
fn bad_recordings_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    succeeds(path, &["run", "stack:3", "--steps", "20", "--record", "a.rec", "--record-contacts"]);
    let good = std::fs::read(path.join("a.rec")).unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(path.join(name), bytes).unwrap();
    write("cut.rec", &good[..good.len() / 2]);
    let mut newer = good.clone();
    newer[8] = 2;
    write("newer.rec", &newer);
    let mut damaged = good.clone();
    damaged[good.len() / 2] ^= 0xff;
    write("damaged.rec", &damaged);
    write("other.rec", b"step,time,body");
    write("empty.rec", b"");
    refused(path, &["replay", "cut.rec"], &["cut.rec", "damaged"]);
    refused(path, &["replay", "a.rec", "newer.rec"], &["newer.rec", "version 2"]);
    refused(path, &["replay", "damaged.rec"], &["damaged.rec"]);
    refused(path, &["replay", "other.rec"], &["other.rec", "not a recording"]);
    refused(path, &["replay", "empty.rec"], &["empty.rec", "not a recording"]);
    refused(path, &["replay", "none.rec"], &["none.rec"]);
    refused(path, &["replay", "a.rec", "a.rec", "a.rec", "a.rec", "a.rec"], &["5", "4"]);
    refused(path, &["run", "stack:3", "--record", "no/such/a.rec"], &["no/such/a.rec"]);
    refused(path, &["run", "stack:3", "--record", "s.csv", "--state", "s.csv"], &["record", "same file"]);
    refused(path, &["run", "stack:3", "--record-contacts"], &["--record"]);
}

#[test]
fn every_k_th_step_is_recorded_and_nothing_of_a_run_that_diverges() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    succeeds(path, &["run", "stack:3", "--steps", "60", "--record", "all.rec"]);
    succeeds(path, &["run", "stack:3", "--steps", "60", "--record", "some.rec", "--every", "6"]);
    let read = |name: &str| simpulse::lab::recording::read::read_file(&path.join(name)).unwrap().1;
    let (all, some) = (read("all.rec"), read("some.rec"));
    assert_eq!((all.frames.len(), some.frames.len(), some.header.every), (61, 11, 6));
    assert!(some.frames.iter().zip(all.frames.iter().step_by(6)).all(|(a, b)| a == b));
    assert!(some.curves.iter().zip(all.curves.iter().step_by(6)).all(|(a, b)| a == b));
    let scene = r#"{"name":"fast","bodies":[
        {"type":"dynamic","position":[5,0],"velocity":[200000,0],"shapes":[{"circle":{"radius":1}}]}]}"#;
    std::fs::write(path.join("fast.json"), scene).unwrap();
    let output = crate::simpulse(path, &["run", "fast.json", "--record", "fast.rec"]);
    assert_eq!((output.status.code(), path.join("fast.rec").exists()), (Some(1), false));
}
