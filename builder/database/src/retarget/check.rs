//! A mapping as text and JSON, for `gestus retarget --check`.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::{
    registration::floor::Source,
    retarget::{axis, body::Body, map::Retarget, parts::Part},
};

/// The mapping as JSON: `parts`, `joints`, `doubts` and figures.
pub fn json(retarget: &Retarget) -> Value {
    let (source, target) = (&retarget.source, &retarget.target);
    let name = |body: &Body, part: Part| body.parts.get(part).map(|j| body.skeleton.names[j].clone());
    let parts: Vec<Value> = Part::all()
        .into_iter()
        .map(|part| {
            json!({
                "part": part.to_string(),
                "input": name(source, part),
                "database": name(target, part),
                "how": source.parts.how.get(&part).filter(|_| source.parts.get(part).is_some()).map(ToString::to_string),
            })
        })
        .collect();
    let names = |body: &Body, joints: &[usize]| {
        joints.iter().map(|&j| body.skeleton.names[j].clone()).collect::<Vec<_>>()
    };
    let others = source.parts.others(&source.skeleton).collect::<Vec<_>>();
    json!({
        "parts": parts,
        "spine": { "input": names(source, &source.parts.spine), "database": names(target, &target.parts.spine) },
        "neck": { "input": names(source, &source.parts.neck), "database": names(target, &target.parts.neck) },
        "unmapped": names(source, &others),
        "rest_is_upright": source.anatomy.upright,
        "scale": retarget.scale,
        "leg_m": { "input": source.anatomy.leg_m, "database": target.anatomy.leg_m },
        "arm_m": { "input": source.anatomy.arm_m, "database": target.anatomy.arm_m },
        "ankle_height_m": { "input": source.anatomy.ankle_m, "database": target.anatomy.ankle_m },
        "floor_m": source.floor.height_m,
        "floor_from": source.floor.source.name(),
        "up": up(retarget),
        "bytes": retarget.bytes().len(),
        "doubts": retarget.doubts(),
    })
}

/// The axis of the incoming world that is up.
fn up(retarget: &Retarget) -> String {
    let up = retarget.world.inverse() * nalgebra::Vector3::y();
    let longest = up.iamax();
    axis::name((longest, up[longest]))
}

/// The mapping as text.
pub fn text(retarget: &Retarget) -> String {
    let (source, target) = (&retarget.source, &retarget.target);
    let name = |body: &Body, part: Part| {
        body.parts.get(part).map_or("-", |j| body.skeleton.names[j].as_str()).to_owned()
    };
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{:<18} {:<24} {:<24} found by", "part", "input", "database");
    for part in Part::all() {
        let how = source.parts.how.get(&part).filter(|_| source.parts.get(part).is_some());
        let how = how.map_or("-".to_owned(), ToString::to_string);
        let _ = writeln!(
            out,
            "{:<18} {:<24} {:<24} {how}",
            part.to_string(),
            name(source, part),
            name(target, part)
        );
    }
    let names = |body: &Body, joints: &[usize]| {
        joints.iter().map(|&j| body.skeleton.names[j].as_str()).collect::<Vec<_>>().join(", ")
    };
    let _ = writeln!(
        out,
        "spine: {} -> {}",
        names(source, &source.parts.spine),
        names(target, &target.parts.spine)
    );
    let _ = writeln!(
        out,
        "neck:  {} -> {}",
        names(source, &source.parts.neck),
        names(target, &target.parts.neck)
    );
    let others: Vec<usize> = source.parts.others(&source.skeleton).collect();
    if !others.is_empty() {
        let _ = writeln!(
            out,
            "without a counterpart (they turn as in the input, at their mean place in their parent): {}",
            names(source, &others)
        );
    }
    let _ = writeln!(
        out,
        "up is {}; legs {:.2} m, the database's {:.2} m (scale {:.3}); a map of {} bytes",
        up(retarget),
        source.anatomy.leg_m,
        target.anatomy.leg_m,
        retarget.scale,
        retarget.bytes().len()
    );
    let floor = match source.floor.source {
        Source::Stated => ", as told",
        Source::Zero => "",
        Source::Body => ", where the feet stand (--floor states another)",
    };
    let _ = writeln!(out, "the floor is at {:.2} m{floor}", source.floor.height_m);
    let doubts = retarget.doubts();
    for doubt in &doubts {
        let _ = writeln!(out, "doubt: {doubt}");
    }
    if doubts.is_empty() {
        let _ = writeln!(out, "no doubts");
    }
    out
}
