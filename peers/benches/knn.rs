//! Criterion's timing of core and every peer at the recall of core: one query in all classes, streaming.
//!
//! `GESTUS_DATA=folder cargo bench` ; the folder holds BVH files, of which those ending in `_007` are queries.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gestus_core::{Database, search::graph::Limits};
use gestus_peers::{
    measure::{Truth, answer, tuned},
    setup::{Setup, Task, points, streams},
};

fn knn(criterion: &mut Criterion) {
    let Some(data) = std::env::var_os("GESTUS_DATA") else {
        eprintln!("set GESTUS_DATA to a folder of BVH files to run this benchmark");
        return;
    };
    let actions = ["walk", "run", "walk-turn-left", "walk-turn-right"].map(String::from).to_vec();
    let task = Task { data: data.into(), actions, styles: Vec::new(), held_out: "_007".to_string() };
    let setup = Setup::new(&task).expect("a folder that makes a database");
    let database = Database::open(&setup.bytes).expect("the builder's blob opens");
    let classes = points(&database, 40);
    let streams = streams(&database, &setup.clips);
    let truth = Truth::new(&classes, &streams);
    let limits =
        Limits { k: 40, pool: 40, visits: 320, spare: 320, jump: 4.0, cutoff_distance2: f32::INFINITY };
    let methods = tuned(database, limits, &truth).expect("every library builds its index");
    let mut group = criterion.benchmark_group("knn40");
    group.throughput(Throughput::Elements(truth.searches() as u64)).sample_size(10);
    for (mut method, row) in methods {
        group.bench_function(format!("{} at recall {:.4}", row.method, row.recall), |bencher| {
            bencher.iter(|| black_box(answer(method.as_mut(), classes.len(), &streams)));
        });
    }
    group.finish();
}

criterion_group!(benches, knn);
criterion_main!(benches);
