//! Parameters of a [`Config`] by number, so that a host can set them on a board of another build.
//!
//! Numbers are part of the protocol: a number's meaning never changes. Values travel as `f32`, which holds each of
//! them exactly.

use crate::{
    Config, ConfigError, Method, Safety,
    config::{Timing, Yaw},
    methods::mixture::regression::Ridge,
};

macro_rules! parameters {
    ($($(#[$doc:meta])* $name:ident = $number:literal, $text:literal;)*) => {
        $($(#[$doc])* pub const $name: u16 = $number;)*

        /// Every parameter's number and name.
        pub const NAMES: &[(u16, &str)] = &[$(($name, $text)),*];
    };
}

parameters! {
    /// [`Config::k`].
    K = 0, "k";
    /// [`Config::lambda`].
    LAMBDA = 1, "lambda";
    /// [`Config::ridge`]: 0 raw, 1 normalised.
    RIDGE = 2, "ridge";
    /// [`Config::delta`].
    DELTA = 3, "delta";
    /// [`Config::prune`].
    PRUNE = 4, "prune";
    /// [`Config::classes`].
    CLASSES = 5, "classes";
    /// [`Config::kappa`].
    KAPPA = 6, "kappa";
    /// [`Config::rho`].
    RHO = 7, "rho";
    /// [`Config::visits`].
    VISITS = 8, "visits";
    /// [`Config::pool`].
    POOL = 9, "pool";
    /// [`Config::jump`].
    JUMP = 10, "jump";
    /// [`Config::timing`]: 0 free, 1 sync.
    TIMING = 11, "timing";
    /// [`Config::timing_width`].
    TIMING_WIDTH = 12, "timing_width";
    /// [`Config::yaw`]: 0 the input's, 1 predicted.
    YAW = 13, "yaw";
    /// [`Config::confidence`].
    CONFIDENCE = 14, "confidence";
    /// [`Config::preference`].
    PREFERENCE = 15, "preference";
    /// [`Config::halflife_s`].
    HALFLIFE = 16, "halflife_s";
    /// [`Config::method`]: its place in [`Method::ALL`].
    METHOD = 17, "method";
    /// [`Config::contacts`]: 0 false, 1 true.
    CONTACTS = 18, "contacts";
    /// [`Config::safety`]: its place in [`Safety::ALL`].
    SAFETY = 19, "safety";
    /// [`Config::release_m`].
    RELEASE = 20, "release_m";
    /// [`Config::ease_s`].
    EASE = 21, "ease_s";
    /// [`Config::feedback`].
    FEEDBACK = 22, "feedback";
    /// [`Config::speed_limit`].
    SPEED_LIMIT = 23, "speed_limit";
    /// [`Config::output_kappa`].
    OUTPUT_KAPPA = 24, "output_kappa";
}

/// Value of a parameter; `None` of an unknown number.
pub fn value(config: &Config, number: u16) -> Option<f32> {
    let choice = |second: bool| if second { 1.0 } else { 0.0 };
    Some(match number {
        K => f32::from(config.k),
        LAMBDA => config.lambda,
        RIDGE => choice(config.ridge == Ridge::Normalised),
        DELTA => config.delta,
        PRUNE => config.prune,
        CLASSES => f32::from(config.classes),
        KAPPA => config.kappa,
        RHO => config.rho,
        VISITS => f32::from(config.visits),
        POOL => f32::from(config.pool),
        JUMP => config.jump,
        TIMING => choice(config.timing == Timing::Sync),
        TIMING_WIDTH => config.timing_width,
        YAW => choice(config.yaw == Yaw::Predicted),
        CONFIDENCE => config.confidence,
        PREFERENCE => config.preference,
        HALFLIFE => config.halflife_s,
        METHOD => Method::ALL.iter().zip([0.0, 1.0, 2.0]).find(|(m, _)| **m == config.method)?.1,
        CONTACTS => choice(config.contacts),
        SAFETY => Safety::ALL.iter().zip([0.0, 1.0, 2.0]).find(|(s, _)| **s == config.safety)?.1,
        RELEASE => config.release_m,
        EASE => config.ease_s,
        FEEDBACK => config.feedback,
        SPEED_LIMIT => config.speed_limit,
        OUTPUT_KAPPA => config.output_kappa,
        _ => return None,
    })
}

/// The configuration with a parameter set. Ranges are checked where it is put in force
/// ([`Stylizer::set_config`](crate::Stylizer::set_config)).
///
/// # Errors
/// [`ConfigError::Unknown`] of an unknown number, [`ConfigError::Parameter`] of a value that its type can't hold.
pub fn set(config: Config, number: u16, value: f32) -> Result<Config, ConfigError> {
    let choice = || match value {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => Err(ConfigError::Parameter),
    };
    Ok(match number {
        K => config.k(whole(value)?),
        LAMBDA => config.lambda(value),
        RIDGE => config.ridge(if choice()? { Ridge::Normalised } else { Ridge::Raw }),
        DELTA => config.delta(value),
        PRUNE => config.prune(value),
        CLASSES => config.classes(byte(value)?),
        KAPPA => config.kappa(value),
        RHO => config.rho(value),
        VISITS => config.visits(whole(value)?),
        POOL => config.pool(byte(value)?),
        JUMP => config.jump(value),
        TIMING => config.timing(if choice()? { Timing::Sync } else { Timing::Free }),
        TIMING_WIDTH => config.timing_width(value),
        YAW => config.yaw(if choice()? { Yaw::Predicted } else { Yaw::Input }),
        CONFIDENCE => config.confidence(value),
        PREFERENCE => config.preference(value),
        HALFLIFE => config.halflife_s(value),
        METHOD => config.method(*Method::ALL.get(usize::from(byte(value)?)).ok_or(ConfigError::Parameter)?),
        CONTACTS => config.contacts(choice()?),
        SAFETY => config.safety(*Safety::ALL.get(usize::from(byte(value)?)).ok_or(ConfigError::Parameter)?),
        RELEASE => config.release_m(value),
        EASE => config.ease_s(value),
        FEEDBACK => config.feedback(value),
        SPEED_LIMIT => config.speed_limit(value),
        OUTPUT_KAPPA => config.output_kappa(value),
        id => return Err(ConfigError::Unknown { id, have: NAMES.len() as u16 }),
    })
}

fn whole(value: f32) -> Result<u16, ConfigError> {
    // The cast saturates, and NaN becomes 0: what comes back differs then.
    let whole = value as u16;
    if f32::from(whole) == value { Ok(whole) } else { Err(ConfigError::Parameter) }
}

fn byte(value: f32) -> Result<u8, ConfigError> {
    u8::try_from(whole(value)?).map_err(|_| ConfigError::Parameter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_goes_both_ways() {
        let other = Config::new()
            .k(17)
            .lambda(0.3)
            .ridge(Ridge::Normalised)
            .delta(0.9)
            .prune(0.02)
            .classes(3)
            .kappa(1.5)
            .rho(0.25)
            .visits(128)
            .pool(50)
            .jump(9.0)
            .timing(Timing::Sync)
            .timing_width(0.75)
            .yaw(Yaw::Predicted)
            .confidence(2.5)
            .preference(4.0)
            .halflife_s(1.5)
            .method(Method::Statistic)
            .contacts(false)
            .safety(Safety::Hold)
            .release_m(0.5)
            .ease_s(1.0)
            .feedback(3.0)
            .speed_limit(1.5)
            .output_kappa(2.5);
        let mut config = Config::new();
        for (i, &(number, name)) in NAMES.iter().enumerate() {
            assert_eq!(usize::from(number), i);
            let wanted = value(&other, number).expect("it is known");
            assert_ne!(Some(wanted), value(&config, number), "{name}: the test's value is the default's");
            config = set(config, number, wanted).expect("it is in range");
            assert_eq!(value(&config, number), Some(wanted), "{name}");
        }
        assert_eq!(config, other);
    }

    #[test]
    fn odd_values_are_refused() {
        let config = Config::new();
        for (number, value) in [
            (K, 3.5),
            (K, -1.0),
            (K, 7e4),
            (K, f32::NAN),
            (POOL, 300.0),
            (TIMING, 2.0),
            (YAW, 0.5),
            (METHOD, 3.0),
            (SAFETY, 3.0),
        ] {
            assert_eq!(set(config, number, value), Err(ConfigError::Parameter), "{number} {value}");
        }
        let unknown = ConfigError::Unknown { id: 25, have: 25 };
        assert_eq!(set(config, 25, 0.0), Err(unknown));
        assert_eq!(value(&config, 25), None);
    }
}
