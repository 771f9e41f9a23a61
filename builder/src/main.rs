//! The command `gestus`.
use gestus_builder::{annotate, build::BuildOptions, evaluate::loo::*, load::load, pair::Scheme};
use gestus_core::{Config, regress::Ridge};
use std::path::PathBuf;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let list = |s: &str| s.split(',').filter(|s| !s.is_empty()).map(String::from).collect::<Vec<_>>();
    let sel = annotate::Config { data: Some(PathBuf::from("/work/shared/data/bandai-namco-2")),
        actions: list("walk,run,walk-turn-left,walk-turn-right"),
        styles: list("normal,active,elderly,feminine"),
        ..Default::default()
    };
    let l = load(&sel).unwrap();
    if a.iter().any(|s| s == "yaw") {
        let body = gestus_builder::body::Body::of(&l.corpus).unwrap();
        for e in &l.corpus.examples {
            let d = body.clip_dofs(&e.clip);
            let f: Vec<String> = e
                .cycles
                .iter()
                .map(|c| {
                    let (s, t) = c.span();
                    let r = &d[s as usize..t as usize];
                    let m = |k: usize| r.iter().map(|x| x[k]).sum::<f64>() / r.len() as f64;
                    format!("{:.2}/{:.2}/{:.0}", m(4), m(6), (t - s) * m(6) / 30.0 * 57.3)
                })
                .collect();
            println!("{} {}", e.clip.name, f.join("  "));
        }
        return;
    }
    let get = |k: &str, d: f32| {
        a.iter().find_map(|s| s.strip_prefix(&format!("{k}="))).map_or(d, |v| v.parse().unwrap())
    };
    let pairing =
        a.iter().find_map(|s| s.strip_prefix("pair=")).map_or(Scheme::Viterbi, |n| Scheme::named(n).unwrap());
    let c = Config::new()
        .delta(get("delta", 0.2))
        .k(get("k", 40.0) as u16)
        .lambda(get("lambda", 0.1))
        .kappa(get("kappa", 0.25))
        .rho(get("rho", 0.5))
        .timing_width(get("tw", 0.5))
        .ridge(if get("norm", 0.0) > 0.0 { Ridge::Normalised } else { Ridge::Raw });
    let paper = Config::paper();
    let o = LooOptions {
        from: 0,
        to: vec![1, 2],
        folds: get("folds", 2.0) as usize,
        build: BuildOptions { pairing, ..Default::default() },
        configs: vec![("mixture".into(), c), ("mixture-paper".into(), paper)],
        mixtures_only: get("only", 0.0) > 0.0,
    };
    let rows = run(&l.corpus, &o, &|| {}).unwrap();
    if get("rows", 0.0) > 0.0 {
        for r in &rows {
            if ["local-ar", "mixture", "knn", "other-clip"].contains(&r.method.as_str()) {
                println!(
                    "{:10} {:34} {:36} err {:.2} step {:?} dur {:?} third {:.2} var {:?}",
                    r.method,
                    r.clip,
                    r.truth,
                    r.joint_error_cm,
                    r.step_error_ms.map(|v| (v * 100.0).round() / 100.0),
                    r.duration_error.map(|v| (v * 1000.0).round() / 1000.0),
                    r.third_difference,
                    r.variability.map(|v| (v * 100.0).round() / 100.0)
                );
            }
        }
    }
    if get("cyc", 0.0) > 0.0 {
        for e in &l.corpus.examples {
            println!(
                "{} frames {} cycles {:?}",
                e.clip.name,
                e.clip.frames.len(),
                e.cycles
                    .iter()
                    .map(|c| c.knots.iter().map(|k| (k * 10.0).round() / 10.0).collect::<Vec<_>>())
                    .collect::<Vec<_>>()
            );
        }
    }
    let mut methods: Vec<String> = vec![];
    for r in &rows {
        if !methods.contains(&r.method) {
            methods.push(r.method.clone())
        }
    }
    println!(
        "{:28} {:>6} {:>6} {:>6} {:>6} | {:>6} | {:>6} {:>6} | {:>6} {:>6} {:>6}",
        "", "walk", "run", "left", "right", "all", "step", "dur", "third", "var-wr", "var"
    );
    for m in methods {
        let of = |a: Option<usize>| {
            rows.iter()
                .filter(move |r| a.is_none_or(|a| r.action == a))
                .filter(|r| r.method == m)
                .collect::<Vec<_>>()
        };
        let mean = |v: Vec<f64>| v.iter().sum::<f64>() / v.len().max(1) as f64;
        let e = |a| mean(of(a).iter().map(|r| r.joint_error_cm).collect());
        let all = of(None);
        let wr: Vec<f64> = all.iter().filter(|r| r.action < 2).filter_map(|r| r.variability).collect();
        println!(
            "{:28} {:6.2} {:6.2} {:6.2} {:6.2} | {:6.3} | {:6.2} {:6.3} | {:6.2} {:6.2} {:6.2}",
            m,
            e(Some(0)),
            e(Some(1)),
            e(Some(2)),
            e(Some(3)),
            e(None),
            mean(all.iter().filter_map(|r| r.step_error_ms).collect()),
            mean(all.iter().filter_map(|r| r.duration_error).collect()),
            mean(all.iter().map(|r| r.third_difference).collect()),
            mean(wr),
            mean(all.iter().filter_map(|r| r.variability).collect())
        );
    }
}
