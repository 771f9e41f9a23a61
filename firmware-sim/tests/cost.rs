//! The model of `gestus-sim run --board` against the instructions that `cargo xtask budget` has recorded.

use gestus_core::{Config, Database, Method};
use gestus_database::{
    parts::{calibration::Isa, cost::units},
    stream::{Request, stream},
};
use gestus_firmware_sim::board::generated::REFERENCE;

/// Largest relative error of a median frame.
const TOLERANCE: f64 = 0.15;

/// The methods other than the mixture: prefix in `budgets.toml`, method and instruction set.
const ROWS: [(&str, Method, Isa); 5] = [
    ("generated.phase", Method::Phase, Isa::Armv7MFpu),
    ("generated.lti", Method::Lti, Isa::Armv7MFpu),
    ("generated.statistic", Method::Statistic, Isa::Armv7MFpu),
    ("armv6m.generated.phase", Method::Phase, Isa::Armv6M),
    ("rv32imc.generated.phase", Method::Phase, Isa::RiscV),
];

fn budgets() -> toml::Table {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../budgets.toml");
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

/// A number of `budgets.toml`, by its name with dots between.
fn recorded(budgets: &toml::Table, name: &str) -> f64 {
    let (table, key) = name.rsplit_once('.').unwrap();
    let table = table.split('.').try_fold(budgets, |table, key| table.get(key)?.as_table());
    table.and_then(|table| table.get(key)).and_then(toml::Value::as_integer).unwrap() as f64
}

/// The tables of docs/PORTING.md: million instructions of a frame by mixture and phase tables, and the least flash.
#[test]
fn the_document_has_what_is_recorded() {
    let budgets = budgets();
    let document = include_str!("../../docs/PORTING.md");
    let has = |row: &str| assert!(document.contains(row), "docs/PORTING.md has no row: {row}");
    for (board, prefix) in [
        ("Cortex-M4F", "reference"),
        ("RV32IMC, `soft-float`", "rv32imc.reference"),
        ("Armv6-M, `soft-float`", "armv6m.reference"),
    ] {
        let median = |of: &str| recorded(&budgets, &format!("{prefix}{of}.instructions_median")) / 1e6;
        let pair = |of: &str| format!("{:.2}; {:.2}", median(of), median(&format!("{of}.labelled")));
        has(&format!("| {board} | {} | {} |", pair(""), pair(".phase")));
    }
    for method in ["", "mar", "phase", "lti", "statistic"] {
        let (name, key) = match method {
            "" => ("all".to_owned(), "least.flash_bytes".to_owned()),
            method => (format!("`{method}`"), format!("least.{method}.flash_bytes")),
        };
        let bytes = recorded(&budgets, &key) as u64;
        has(&format!("| {name} | {},{:03} | ", bytes / 1000, bytes % 1000));
    }
}

#[test]
fn each_method_is_modelled_near_the_recorded_median() {
    let budgets = budgets();
    let bytes = std::fs::read(REFERENCE.database().unwrap()).unwrap();
    let database = Database::open(&bytes).unwrap();
    let angry = database.manifest().unwrap().styles.find("angry").unwrap();
    let clip = REFERENCE.clip(12.0).unwrap();
    for (prefix, method, isa) in ROWS {
        let request = Request { config: Config::new().method(method), ..Request::style(angry) };
        let streamed = stream(&database, &clip, &request, &mut ()).unwrap();
        let unit_costs = isa.calibration().unit_costs;
        let steps = streamed.steps.iter();
        let mut modelled: Vec<f64> =
            steps.map(|step| unit_costs.total(&units(&database, &request, &step.report))).collect();
        modelled.sort_by(f64::total_cmp);
        let median = recorded(&budgets, &format!("{prefix}.instructions_median"));
        let ratio = modelled[modelled.len() / 2] / median;
        assert!((ratio - 1.0).abs() < TOLERANCE, "{prefix}: {ratio:.2} times the recorded instructions");
    }
}
