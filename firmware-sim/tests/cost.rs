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

#[test]
fn each_method_is_modelled_near_the_recorded_median() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../budgets.toml");
    let budgets: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    let recorded = |prefix: &str| {
        let mut keys = prefix.split('.');
        let table = keys.try_fold(&budgets, |table, key| table.get(key)?.as_table());
        table.and_then(|table| table.get("instructions_median")).and_then(toml::Value::as_integer).unwrap()
            as f64
    };
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
        let ratio = modelled[modelled.len() / 2] / recorded(prefix);
        assert!((ratio - 1.0).abs() < TOLERANCE, "{prefix}: {ratio:.2} times the recorded instructions");
    }
}
