//! Recomputes every frame from the folder of `gestus export` and the file of `gestus translate --trace` alone, as somebody
//! without the source code would.

use std::{collections::HashMap, fs, path::Path};

use gestus_core::{Config, Database, config::Ridge};
use gestus_database::{
    blob::export::export,
    build::{BuildOptions, build},
    stream::{Request, stream, trace::Trace},
};
use gestus_tests::{
    motion,
    reference::{self, Example, Parameters},
};
use npyz::NpyFile;
use serde_json::Value;
use zip::ZipArchive;

/// Arrays by name, as `f64`, and their shapes.
#[derive(Default)]
struct Arrays(HashMap<String, (Vec<u64>, Vec<f64>)>);

impl Arrays {
    fn put<R: std::io::Read>(&mut self, name: &str, file: NpyFile<R>) {
        let shape = file.shape().to_vec();
        let values: Vec<f64> = match file.dtype().descr().trim_matches(['\'', '<', '|']) {
            "f4" => file.into_vec::<f32>().unwrap().into_iter().map(f64::from).collect(),
            "i4" => file.into_vec::<i32>().unwrap().into_iter().map(f64::from).collect(),
            "u1" => file.into_vec::<u8>().unwrap().into_iter().map(f64::from).collect(),
            other => panic!("{name} holds {other}"),
        };
        assert_eq!(shape.iter().product::<u64>(), values.len() as u64, "{name}");
        self.0.insert(name.to_owned(), (shape, values));
    }

    fn folder(path: &Path) -> Self {
        let mut arrays = Self::default();
        for entry in fs::read_dir(path).unwrap().map(|e| e.unwrap().path()) {
            if entry.extension().is_some_and(|e| e == "npy") {
                let name = entry.file_stem().unwrap().to_string_lossy().into_owned();
                arrays.put(&name, NpyFile::new(&fs::read(&entry).unwrap()[..]).unwrap());
            }
        }
        arrays
    }

    fn archive(path: &Path) -> Self {
        let mut arrays = Self::default();
        let mut archive = ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
        for i in 0..archive.len() {
            let file = archive.by_index(i).unwrap();
            let name = file.name().strip_suffix(".npy").unwrap().to_owned();
            arrays.put(&name, NpyFile::new(file).unwrap());
        }
        arrays
    }

    fn shape(&self, name: &str) -> Vec<usize> {
        self.0[name].0.iter().map(|&v| v as usize).collect()
    }

    /// Row `index` of an array along its first axis.
    fn row(&self, name: &str, index: usize) -> &[f64] {
        let (shape, values) = &self.0[name];
        let length = shape[1..].iter().product::<u64>() as usize;
        &values[index * length..][..length]
    }

    fn at(&self, name: &str, index: usize) -> f64 {
        self.0[name].1[index]
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn near(what: &str, t: usize, a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "frame {t}, {what}: traced {a}, computed {b}");
}

/// The files of one stream, recomputed.
fn recompute(folder: &str, blob: &[u8], request: &Request) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    let database = Database::open(blob).unwrap();
    export(&database, &folder).unwrap();
    let clip = motion::joined(&motion::unseen(0, 0, 25), &motion::unseen(1, 1, 10));
    let mut trace = Trace::of(&database, request);
    stream(&database, &clip, request, &mut trace).unwrap();
    trace.write(&folder.join("trace.npz"), &database, request).unwrap();

    // From here on, only files are used.
    let stored = Arrays::folder(&folder);
    let traced = Arrays::archive(&folder.join("trace.npz"));
    let manifest: Value = serde_json::from_slice(&fs::read(folder.join("manifest.json")).unwrap()).unwrap();
    let config: Vec<u8> = traced.0["config"].1.iter().map(|&b| b as u8).collect();
    let config: Value = serde_json::from_slice(&config).unwrap();
    let [n, d] = stored.shape("dofs")[..] else { panic!("dofs are a table") };
    let [frames, classes, k] = traced.shape("neighbors")[..] else { panic!("[T x C x K]") };
    assert_eq!(frames, 35);
    assert_eq!(classes, manifest["classes"].as_array().unwrap().len());
    assert_eq!(d, manifest["dofs"].as_array().unwrap().len());
    assert_eq!(k as u64, config["k"].as_u64().unwrap());
    let number = |name: &str| config[name].as_f64().unwrap();
    let scales = numbers(&manifest["scales"]);
    let styles: Vec<&str> =
        manifest["styles"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
    let parameters = Parameters {
        k,
        lambda: number("lambda"),
        normalised: config["ridge_mode"] == "norm",
        feedback: number("feedback"),
        output_kappa: number("output_kappa"),
        delta: number("delta"),
        kappa: number("kappa"),
        rho: number("rho"),
        liveliness: 0.0,
        settle_s: 0.0,
        styles: numbers(&config["style_weights"]),
        // Not in the trace, and not needed below.
        prune: 0.0,
        classes: 0,
        timing_width: 0.0,
        searched: vec![],
        strength: vec![],
    };
    let strength = numbers(&config["strength"]);
    let mask = numbers(&config["metric_mask"]);
    let caps = numbers(&config["k_per_class"]);
    let blended = |name: &str, row: usize| -> Vec<f64> {
        let mut sum = vec![0.0; stored.row(&format!("{name}_{}", styles[0]), row).len()];
        for (style, weight) in styles.iter().zip(&parameters.styles).filter(|(_, w)| **w > 0.0) {
            assert_eq!(stored.at(&format!("output_valid_{style}"), row), 1.0, "row {row}");
            let values = stored.row(&format!("{name}_{style}"), row);
            sum.iter_mut().zip(values).for_each(|(s, v)| *s += weight * v);
        }
        sum
    };
    let distance2 = |t: usize, row: usize| -> f64 {
        let pairs = traced.row("query", t).iter().zip(stored.row("features", row));
        pairs.zip(&mask).map(|((q, f), m)| m * (q - f).powi(2)).sum()
    };

    let names: Vec<&str> = manifest["dofs"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    let legs = ["L", "R"].map(|side| -> Vec<usize> {
        let of = |name: &&str| {
            ["UpperLeg", "LowerLeg", "Foot"].iter().any(|part| name.starts_with(&format!("{part}_{side}.")))
        };
        (0..d).filter(|&j| of(&names[j])).collect()
    });
    assert!(legs.iter().all(|leg| leg.len() == 9), "{names:?}");
    let rate_hz = manifest["rate_hz"].as_f64().unwrap();
    let mut smooth = [0.0; 2];
    for t in 0..frames {
        let rows_of = |name: &str, c: usize| -> Vec<usize> {
            let all = &traced.row(name, t)[c * k..][..k];
            all.iter().filter(|r| **r >= 0.0).map(|&r| r as usize).collect()
        };
        let mut means = Vec::new();
        for c in 0..classes {
            let found = rows_of("neighbors", c);
            if found.is_empty() {
                assert_eq!(traced.row("proportion", t)[c], 0.0);
                continue;
            }
            assert_eq!(found.len(), caps[c] as usize);
            let mut sum = 0.0;
            for (i, &row) in found.iter().enumerate() {
                assert_eq!((stored.at("class", row), stored.at("searchable", row)), (c as f64, 1.0));
                let own = distance2(t, row);
                near("distance", t, traced.row("distance2", t)[c * k + i], own, 1e-4 * own + 1e-8);
                sum += own;
            }
            let mean = sum / found.len() as f64;
            near("mean", t, traced.row("mean_distance2", t)[c], mean, 1e-4 * mean + 1e-8);
            // Small classes are searched completely, so the neighbors are exact.
            let mut all: Vec<f64> = (0..n)
                .filter(|&r| stored.at("class", r) == c as f64 && stored.at("searchable", r) == 1.0)
                .map(|r| distance2(t, r))
                .collect();
            all.sort_by(f64::total_cmp);
            let best = all[..found.len()].iter().sum::<f64>() / found.len() as f64;
            near("nearest", t, mean, best, 1e-4 * best);
            means.push((c, mean));
        }
        let (mut y, mut step_s, mut stands, mut total) = (vec![0.0; d], 0.0, [0.0; 2], [0.0; 2]);
        let all = reference::proportions(&means, parameters.delta);
        let kept: f64 = all.iter().filter(|s| traced.row("proportion", t)[s.0] > 0.0).map(|s| s.1).sum();
        for &(c, own) in &all {
            let proportion = traced.row("proportion", t)[c];
            if proportion == 0.0 {
                // A frame keeps the four heaviest, one in which classes are searched again the two heaviest.
                let kept = traced.row("proportion", t).iter().filter(|p| **p > 0.0).count();
                assert!(
                    own < 1.1 * f64::from(Config::new().prune) || kept == 4 || kept == 2,
                    "frame {t}: {own} of the weight was dropped at once"
                );
                continue;
            }
            near("proportion", t, proportion, own / kept, 1e-3);
            let rows = rows_of("timing_neighbors", c);
            let mut sorted = rows_of("neighbors", c);
            sorted.sort_unstable();
            let mut timed = rows.clone();
            timed.sort_unstable();
            assert_eq!(timed, sorted, "frame {t}, class {c}");
            let examples: Vec<Example> = rows
                .iter()
                .map(|&row| Example {
                    x_prev: stored.row("dofs", stored.at("previous", row) as usize).to_vec(),
                    x: stored.row("dofs", row).to_vec(),
                    y_prev: blended("output_prev", row),
                    y: blended("output", row),
                    step_s: blended("output_step", row)[0],
                })
                .collect();
            let now = ["input_prev", "output_prev", "input"].map(|name| traced.row(name, t));
            for (j, sum) in y.iter_mut().enumerate() {
                let (now, rho) = (now.map(|v| v[j]), parameters.rho);
                let [answer, ..] = reference::regress(&examples, j, now, scales[j], &parameters, rho);
                *sum += proportion * answer;
            }
            let weights = &traced.row("timing_weights", t)[c * k..][..rows.len()];
            near("sum of timing weights", t, weights.iter().sum(), 1.0, 1e-5);
            step_s += proportion * weights.iter().zip(&examples).map(|(w, e)| w * e.step_s).sum::<f64>();
            // Each foot by its own leg: pose and rate of nine dofs, and the labels of the outputs.
            let (x, x_prev) = (traced.row("input", t), traced.row("input_prev", t));
            for (&row, example) in rows.iter().zip(&examples) {
                let (own, output) = (stored.row("contacts", row), blended("output_contacts", row));
                for (side, leg) in legs.iter().enumerate() {
                    let distance2: f64 = leg
                        .iter()
                        .map(|&j| {
                            let pose = x[j] - example.x[j];
                            let rate = 0.2 * rate_hz * (pose - (x_prev[j] - example.x_prev[j]));
                            pose * pose + rate * rate
                        })
                        .sum();
                    let weight = proportion / (distance2 + 3e-8).powi(2);
                    let label = own[side] + strength[0].min(1.0) * (output[side] - own[side]);
                    total[side] += weight;
                    stands[side] += weight * label;
                }
            }
        }
        let yaw = manifest["dofs"].as_array().unwrap().iter().position(|n| n == "root.yaw").unwrap();
        y[yaw] = traced.row("input", t)[yaw];
        for j in 0..d {
            let x = traced.row("input", t)[j];
            let own = x + strength[j] * (y[j] - x);
            near(&format!("dof {j}"), t, traced.row("predicted", t)[j], own, 1e-4);
            if t > 0 {
                near("input before", t, traced.row("input_prev", t)[j], traced.row("input", t - 1)[j], 0.0);
                if strength[j] == 1.0 {
                    let last = traced.row("predicted", t - 1)[j];
                    near("output before", t, traced.row("output_prev", t)[j], last, 1e-6);
                }
            }
        }
        near("step", t, traced.at("step_seconds", t), step_s, 1e-6);
        for (side, stands) in stands.into_iter().enumerate() {
            let vote = stands / total[side];
            let vote = if t == 0 { vote } else { smooth[side] + 0.9 * (vote - smooth[side]) };
            smooth[side] = vote;
            let traced = traced.row("contacts", t)[side] == 1.0;
            assert!((vote - 0.5).abs() < 1e-3 || traced == (vote > 0.5), "frame {t}, foot {side}: {vote}");
        }
    }
}

#[test]
fn the_default_can_be_recomputed_from_files() {
    // Contacts as voted, before the foot lock.
    let request = Request { config: Config::new().contacts(false), ..Request::style(1) };
    recompute("export-default", motion::small(), &request);
}

#[test]
fn every_setting_can_be_recomputed_from_files() {
    let config = Config::new().ridge(Ridge::Normalised).lambda(1.0).kappa(1.0).rho(0.9).delta(0.7).k(12);
    let config = config.feedback(5.0).contacts(false);
    let request = Request {
        style: vec![(0, 1.0), (2, 3.0)],
        action: Some(1),
        masked: vec![2],
        strength: vec![(1, 0.5)],
        config,
        ..Request::style(0)
    };
    recompute("export-settings", motion::small(), &request);
}

#[test]
fn a_condensed_database_can_be_recomputed_from_files() {
    let options = BuildOptions { cycles: 3, ..BuildOptions::default() };
    let blob = build(&motion::corpus(motion::LARGE), &options).unwrap().bytes;
    let request = Request { config: Config::new().contacts(false), ..Request::style(2) };
    recompute("export-condensed", &blob, &request);
}
