//! Joints that follow others, without a motor of their own.

/// Greatest multiplier and offset of a joint that follows another one.
const MAX_FOLLOWED: f64 = 1e3;

/// How a hinge follows a joint: `angle = multiplier * the joint's + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Mimic {
    /// The joint's name.
    pub joint: String,
    /// 1 where the file says none.
    pub multiplier: f64,
    /// Radians; 0 where the file says none.
    pub offset: f64,
}

/// What a joint follows, if anything.
pub(super) fn mimic(joint: &urdf_rs::Joint) -> Result<Option<Mimic>, String> {
    let mimics = joint.mimic.as_ref().map(|mimic| Mimic {
        joint: mimic.joint.clone(),
        multiplier: mimic.multiplier.unwrap_or(1.0),
        offset: mimic.offset.unwrap_or(0.0),
    });
    if mimics
        .iter()
        .any(|m| [m.multiplier, m.offset].iter().any(|v| !v.is_finite() || v.abs() > MAX_FOLLOWED))
    {
        return Err(format!("the numbers of its `mimic` are beyond {MAX_FOLLOWED}"));
    }
    Ok(mimics)
}
