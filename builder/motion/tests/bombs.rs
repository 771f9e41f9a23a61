//! Small files that ask for much: memory stays at 6 times the file and 50 MB, and time in proportion to the size.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
    time::{Duration, Instant},
};

use base64::{Engine, engine::general_purpose::STANDARD};
use gestus_motion::{
    binding::{Options, to_clip},
    capture::{self, CaptureError, read_folder},
    files::{FileError, write},
    formats::{
        bvh::{Bvh, BvhErrorKind, MAX_JOINTS},
        gltf::{self, GltfErrorKind},
        urdf::{Robot, UrdfError},
    },
};
use meshoptimizer_rs::{
    Workspace,
    codec::{VertexEncoding, encode_vertex_buffer},
};
use serde_json::json;

/// The system's memory, counted.
struct Counted;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is passed on as it came.
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Relaxed) + layout.size();
        PEAK.fetch_max(now, Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(at, layout) }
    }
}

#[global_allocator]
static MEMORY: Counted = Counted;

/// Runs a reading and checks what it takes, beside the file's own bytes that are there before it.
fn within<T>(what: &str, bytes: usize, read: impl FnOnce() -> T) -> T {
    let before = NOW.load(Relaxed);
    PEAK.store(before, Relaxed);
    let start = Instant::now();
    let result = read();
    let (took, time) = (PEAK.load(Relaxed) - before, start.elapsed());
    println!("{what}: {bytes} bytes, {:.1} MB, {:.2} s", took as f64 / 1e6, time.as_secs_f64());
    assert!(took <= 6 * bytes + 50_000_000, "{what}: {took} bytes of memory for {bytes}");
    // A second for each 2 MB in a debug build, and a few for the start: quadratic time takes minutes.
    assert!(time < Duration::from_secs(8 + bytes as u64 / 2_000_000), "{what}: {time:?}");
    result
}

/// A BVH file: so many joints, of which so many have channels, and frames of that text.
fn bvh(joints: usize, moving: usize, frames: usize, row: &str) -> String {
    let mut text = "HIERARCHY ROOT r{OFFSET 0 0 0 CHANNELS 1 Xrotation\n".to_owned();
    for j in 1..joints {
        let channels = if j < moving { "CHANNELS 3 Zrotation Xrotation Yrotation " } else { "" };
        text += &format!("JOINT j{j}{{OFFSET 0 1 0 {channels}}}\n");
    }
    text + &format!("}}\nMOTION\nFrames: {frames}\nFrame Time: 0.01\n") + &row.repeat(frames)
}

fn bvh_error(text: &str) -> BvhErrorKind {
    within("bvh", text.len(), || Bvh::parse(text.as_bytes(), "bomb.bvh")).unwrap_err().kind
}

fn bvh_bombs() {
    let bomb = bvh(10_000, 1, 40_000, "0\n");
    assert_eq!(bvh_error(&bomb), BvhErrorKind::TooManyJoints { limit: MAX_JOINTS });
    let bomb = bvh(4_000, 1, 40_000, "0\n");
    assert!(matches!(bvh_error(&bomb), BvhErrorKind::TooMuch { joints: 4_000, frames: 40_000, .. }));
    // A header that promises what is not there.
    let text = bvh(3, 1, 9, "0\n").replace("Frames: 9", "Frames: 18446744073709551615");
    assert!(matches!(bvh_error(&text), BvhErrorKind::FrameCountLies { found: 9, .. }));
    let deep = format!("HIERARCHY ROOT r{{{}", "JOINT j{OFFSET 0 0 0 ".repeat(100_000));
    assert!(matches!(bvh_error(&deep), BvhErrorKind::DuplicateJoint { .. }));
    let deep: String = (0..100_000).map(|j| format!("JOINT j{j}{{ ")).collect();
    assert!(matches!(bvh_error(&format!("HIERARCHY ROOT r{{ {deep}")), BvhErrorKind::TooDeep { .. }));
    let sites = format!("HIERARCHY ROOT r{{{}", "End Site{OFFSET 0 0 0}".repeat(200_000));
    bvh_error(&sites);
    // An honest file of some size is read, through to the clip.
    let row = "12.3456 ".repeat(1 + 3 * 59) + "\n";
    let honest = bvh(60, 60, 4_000, &row);
    let clip = within("an honest clip", honest.len(), || {
        let document = Bvh::parse(honest.as_bytes(), "walk.bvh").unwrap();
        to_clip(&document, &Options::default()).unwrap().0
    });
    assert_eq!(clip.frames.len(), 4_000);
}

/// A `.glb` of a chain of joints that all turn, and of their motion: honest, and most of it keys of that many bytes.
fn glb(joints: usize, keys: usize, narrow: bool) -> Vec<u8> {
    let times: Vec<u8> = (0..keys).flat_map(|k| (k as f32 / 60.0).to_le_bytes()).collect();
    let (component, width) = if narrow { (5122, 2) } else { (5126, 4) };
    let turn = |k: usize, j: usize| {
        let half = 0.4 * (0.05 * k as f64 + j as f64).sin();
        [half.sin(), 0.0, 0.0, half.cos()]
    };
    let mut bin = times.clone();
    for j in 0..joints {
        for k in 0..keys {
            for value in turn(k, j) {
                if narrow {
                    bin.extend(((value * 32_767.0).round() as i16).to_le_bytes());
                } else {
                    bin.extend((value as f32).to_le_bytes());
                }
            }
        }
    }
    let size = 4 * width * keys;
    let rotations =
        (0..joints).map(|j| json!({ "buffer": 0, "byteOffset": times.len() + j * size, "byteLength": size }));
    let mut made = overlapping(joints, keys);
    made["bufferViews"] =
        [json!({ "buffer": 0, "byteLength": times.len() })].into_iter().chain(rotations).collect();
    made["buffers"] = json!([{ "byteLength": bin.len() }]);
    for j in 0..joints {
        made["accessors"][j]["bufferView"] = json!(j + 1);
        made["accessors"][j]["componentType"] = json!(component);
        made["accessors"][j]["normalized"] = json!(narrow);
        if j > 0 {
            made["nodes"][j]["translation"] = json!([0.0, 0.1, 0.0]);
        }
    }
    made["accessors"][joints]["bufferView"] = json!(0);
    let mut text = made.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let mut file = [&b"glTF"[..], &word(2), &word(28 + text.len() + bin.len())].concat();
    for (kind, chunk) in [(&b"JSON"[..], &text), (b"BIN\0", &bin)] {
        file.extend([&word(chunk.len())[..], kind, chunk].concat());
    }
    file
}

/// What is written of honest files: the document, its clip and the file that comes out, all at once.
fn writers(folder: &Path) {
    let row = "12.3456 ".repeat(1 + 3 * 59) + "\n";
    let text = bvh(60, 60, 20_000, &row);
    let written = within("bvh, out again", text.len(), || {
        let document = Bvh::parse(text.as_bytes(), "walk.bvh").unwrap();
        let (clip, binding) = to_clip(&document, &Options::default()).unwrap();
        binding.write(&document, &clip).unwrap().to_text()
    });
    assert!(written.len() > text.len() / 2);
    let path = folder.join("walk.glb");
    for (narrow, keys) in [(false, 50_000), (true, 16_000)] {
        let name = if narrow { "glb of short numbers" } else { "glb" };
        let size = {
            let file = glb(40, keys, narrow);
            write(&path, &file).unwrap();
            file.len()
        };
        let document = within(name, size, || capture::read(&path).unwrap());
        let (clip, binding) = to_clip(&document, &Options::default()).unwrap();
        let written = within(&format!("{name}, out again"), size, || {
            document.write(&binding, &clip, &path, None).unwrap()
        });
        assert!(written.len() > size, "{name}");
    }
}

/// A glTF file of a body of two nodes, with that many animations of accessors that all begin at byte 0 of a buffer.
fn overlapping(channels: usize, keys: usize) -> serde_json::Value {
    let nodes: Vec<_> = (0..channels)
        .map(|n| json!({ "children": if n + 1 < channels { vec![n + 1] } else { vec![] } }))
        .collect();
    let accessors: Vec<_> = (0..channels)
        .map(|_| json!({ "bufferView": 1, "componentType": 5121, "normalized": true, "type": "VEC4", "count": keys }))
        .chain([json!({ "bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": keys, "min": [0.0], "max": [9.0] })])
        .collect();
    let samplers: Vec<_> = (0..channels).map(|c| json!({ "input": channels, "output": c })).collect();
    let moved: Vec<_> =
        (0..channels).map(|c| json!({ "sampler": c, "target": { "node": c, "path": "rotation" } })).collect();
    json!({
        "asset": { "version": "2.0" }, "nodes": nodes, "accessors": accessors,
        "bufferViews": [{ "buffer": 0, "byteLength": 4 * keys }, { "buffer": 0, "byteLength": 4 * keys }],
        "buffers": [{ "uri": "keys.bin", "byteLength": 4 * keys }],
        "animations": [{ "samplers": samplers, "channels": moved }],
    })
}

fn gltf_error(what: &str, text: &str, data: &[u8]) -> GltfErrorKind {
    let open = |_: &Path| Ok(data.to_vec());
    within(what, text.len() + data.len(), || gltf::parse(text.as_bytes(), "bomb.gltf", &open))
        .unwrap_err()
        .kind
}

fn gltf_bombs() {
    // From one frame on: zeros are no rotation.
    let times: Vec<u8> = (1..=500_000u32).flat_map(|k| (k as f32 / 60.0).to_le_bytes()).collect();
    let said = gltf_error("overlap", &overlapping(200, 500_000).to_string(), &times);
    assert!(matches!(said, GltfErrorKind::Accessor { .. } | GltfErrorKind::TooLong { .. }), "{said}");
    // The same in many animations.
    let mut many = overlapping(20, 1_000);
    let one = many["animations"][0].clone();
    many["animations"] = vec![one; 2_000].into();
    let said = gltf_error("animations", &many.to_string(), &times[..4_000]);
    assert!(matches!(said, GltfErrorKind::TooLong { .. } | GltfErrorKind::TooMuch { .. }), "{said}");
    // Giant counts, and keys a day apart.
    let mut made = overlapping(2, 2);
    made["accessors"][0]["count"] = json!(u32::MAX);
    assert!(matches!(
        gltf_error("count", &made.to_string(), &times[..8]),
        GltfErrorKind::Accessor { accessor: 0, .. }
    ));
    let day: Vec<u8> = [1f32, 86_400.0].iter().flat_map(|t| t.to_le_bytes()).collect();
    assert!(matches!(
        gltf_error("a day", &overlapping(2, 2).to_string(), &day),
        GltfErrorKind::TooLong { .. }
    ));
    // Sparse accessors may say that they hold any number of zeros.
    let mut made = overlapping(2, 2);
    made["accessors"][0] = json!({ "componentType": 5126, "type": "VEC4", "count": u32::MAX, "sparse": {
        "count": 1, "indices": { "bufferView": 0, "componentType": 5125 }, "values": { "bufferView": 1 } } });
    let said = gltf_error("sparse", &made.to_string(), &times[..8]);
    assert!(matches!(said, GltfErrorKind::Accessor { accessor: 0, .. }), "{said}");
    // JSON that is larger in memory than on disk.
    for (what, item) in [
        ("nodes", "{},"),
        ("accessors", "{},"),
        ("nodes", r#"{"children":[9]},"#),
        ("extensionsRequired", r#""","#),
    ] {
        let list = item.repeat(3_000_000 / item.len());
        let text = format!(r#"{{"asset":{{"version":"2.0"}},"{what}":[{}]}}"#, list.trim_end_matches(','));
        gltf_error(what, &text, &[]);
    }
    let deep = format!(r#"{{"asset":{{"version":"2.0"}},"extras":{}}}"#, "[".repeat(1_000_000));
    assert!(matches!(
        gltf_error("deep", &deep, &[]),
        GltfErrorKind::NotGltf(_) | GltfErrorKind::TooMuch { .. }
    ));
    let chain: Vec<_> = (1..=20_000).map(|n| json!({ "children": [n] })).chain([json!({})]).collect();
    let text = json!({ "asset": { "version": "2.0" }, "nodes": chain }).to_string();
    assert!(matches!(gltf_error("chain", &text, &[]), GltfErrorKind::TooDeep { .. }));
}

/// Views that say that they unpack to far more than the file has bytes.
fn packed_bombs() {
    // A body whose rotations are packed; a thousand numbers a byte.
    let packed = |count: usize, stream: &[u8]| {
        let mut made = overlapping(1, 2);
        let view = json!({ "buffer": 0, "byteOffset": 8, "byteLength": stream.len(), "byteStride": 4, "count": count,
            "mode": "ATTRIBUTES" });
        made["bufferViews"][1] = json!({ "buffer": 1, "byteLength": 4 * count,
            "extensions": { "KHR_meshopt_compression": view } });
        made["buffers"] =
            json!([{ "uri": "keys.bin", "byteLength": 8 + stream.len() }, { "byteLength": 4 * count }]);
        let times: Vec<u8> = [1f32, 2.0].iter().flat_map(|t| t.to_le_bytes()).collect();
        (made, [&times[..], stream].concat())
    };
    let zeros = vec![0; 400_000_000];
    let work = &mut Workspace::default();
    let stream = encode_vertex_buffer(&zeros, zeros.len() / 4, 4, VertexEncoding::DEFAULT, work).unwrap();
    let all = zeros.len() / 4;
    drop(zeros);
    assert!(stream.len() < 500_000);
    let (made, data) = packed(all, &stream);
    let said = gltf_error("zeros", &made.to_string(), &data);
    assert!(matches!(said, GltfErrorKind::Inflates { view: 1, .. }), "{said}");
    // A promise without bytes, and one that no number holds.
    for count in [5_000_000, u32::MAX as usize, usize::MAX / 4, usize::MAX] {
        let (mut made, data) = packed(2, &stream[..40]);
        made["bufferViews"][1]["extensions"]["KHR_meshopt_compression"]["count"] = json!(count);
        let said = gltf_error("promise", &made.to_string(), &data);
        assert!(matches!(said, GltfErrorKind::Inflates { .. } | GltfErrorKind::Packed { .. }), "{said}");
    }
    // Many views of the same bytes, each within the limit.
    let count = 1_600_000;
    let turn = [0, 0, 0, 255].repeat(count);
    let part = encode_vertex_buffer(&turn, count, 4, VertexEncoding::DEFAULT, work).unwrap();
    drop(turn);
    let (one, data) = packed(count, &part);
    let mut made = overlapping(50, 2);
    made["buffers"] = one["buffers"].clone();
    let views: Vec<_> = (0..50).map(|_| one["bufferViews"][1].clone()).collect();
    made["bufferViews"] = [one["bufferViews"][0].clone()].into_iter().chain(views).collect();
    for j in 0..50 {
        made["accessors"][j]["bufferView"] = json!(j + 1);
    }
    made["accessors"][50]["bufferView"] = json!(0);
    let said = gltf_error("many", &made.to_string(), &data);
    assert!(matches!(said, GltfErrorKind::Inflates { .. }), "{said}");
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&data));
    made["buffers"][0]["uri"] = json!(uri);
    let unpacked = |made: &serde_json::Value| {
        let text = made.to_string();
        within("unpacked", text.len(), || gltf::unpacked(text.as_bytes(), "bomb.gltf"))
    };
    let said = unpacked(&made);
    assert!(matches!(said.unwrap_err().kind, GltfErrorKind::Inflates { .. }));
    for view in &mut made["bufferViews"].as_array_mut().unwrap()[2..] {
        view["extensions"] = json!({});
    }
    assert!(unpacked(&made).unwrap().len() > 4 * count);
}

fn urdf_bombs() {
    let error =
        |what: &str, text: &str| within(what, text.len(), || Robot::parse(text, "bomb.urdf")).unwrap_err();
    let links = format!("<robot name='r'>{}</robot>", "<link name='a'/>".repeat(150_000));
    assert!(matches!(error("links", &links), UrdfError::Elements { .. }));
    let attributes: String = (0..200_000).map(|i| format!(" a{i}=''")).collect();
    let text = format!("<robot name='r'><limit{attributes}/></robot>");
    assert!(matches!(error("attributes", &text), UrdfError::Tag { line: 1, .. }));
}

/// A buffer is in the folder of the clip, whatever its URI says; and one bad file costs that file.
fn a_folder_of_traps(folder: &Path) {
    let clips = folder.join("clips");
    std::fs::create_dir(&clips).unwrap();
    let times: Vec<u8> = [1f32, 2.0].iter().flat_map(|t| t.to_le_bytes()).collect();
    write(&folder.join("keys.bin"), &times).unwrap();
    write(&clips.join("keys.bin"), &times).unwrap();
    let with = |name: &str, uri: &str| {
        let mut made = overlapping(2, 2);
        made["buffers"][0]["uri"] = json!(uri);
        let path = clips.join(name);
        write(&path, made.to_string()).unwrap();
        path
    };
    capture::read(&with("good.gltf", "keys.bin")).unwrap();
    let reason = |path: PathBuf| match within("uri", 1_000, || capture::read(&path)).unwrap_err() {
        CaptureError::Gltf(gltf::GltfError { kind: GltfErrorKind::Buffer { reason, .. }, .. }) => reason,
        other => panic!("{}: {other}", path.display()),
    };
    let absolute = folder.join("keys.bin");
    for (i, uri) in [
        "../keys.bin",
        "%2e%2e/keys.bin",
        "x/../../keys.bin",
        absolute.to_str().unwrap(),
        "/dev/zero",
        "file:///dev/zero",
    ]
    .iter()
    .enumerate()
    {
        assert_eq!(reason(with(&format!("out{i}.gltf"), uri)), FileError::Outside, "{uri}");
    }
    assert!(matches!(reason(with("none.gltf", "none.bin")), FileError::Io(_)));
    assert_eq!(reason(with("folder.gltf", "./")), FileError::NotRegular);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("/dev/zero", clips.join("zero.bin")).unwrap();
        assert_eq!(reason(with("zero.gltf", "zero.bin")), FileError::Outside);
        std::os::unix::fs::symlink("/dev/zero", clips.join("zero.bvh")).unwrap();
        if std::process::Command::new("mkfifo")
            .arg(clips.join("pipe.bin"))
            .status()
            .is_ok_and(|s| s.success())
        {
            assert_eq!(reason(with("pipe.gltf", "pipe.bin")), FileError::NotRegular);
        }
    }
    write(&clips.join("bomb.bvh"), bvh(4_000, 1, 40_000, "0\n")).unwrap();
    write(&clips.join("walk.bvh"), bvh(3, 3, 9, "1 2 3 4 5 6 7\n")).unwrap();
    let found = within("folder", 300_000, || read_folder(&clips)).unwrap();
    let names: Vec<_> =
        found.documents.iter().map(|(path, _)| path.file_name().unwrap().to_owned()).collect();
    assert_eq!(names, ["good.gltf", "walk.bvh"]);
    assert!(found.skipped.len() >= 9, "{:?}", found.skipped);
}

/// One test: the count is of the whole process.
#[test]
fn no_file_takes_more_than_its_share() {
    bvh_bombs();
    gltf_bombs();
    packed_bombs();
    urdf_bombs();
    let folder = tempfile::tempdir().unwrap();
    writers(folder.path());
    a_folder_of_traps(folder.path());
}
