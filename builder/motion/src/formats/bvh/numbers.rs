//! Numbers of a document, within bounds that no body exceeds.

use super::{
    document::Channel,
    error::{BvhError, BvhErrorKind as Kind},
    lexer::Token,
    parse::{Parser, shown_name},
};

/// Greatest length, file units: ten thousand kilometres in millimetres.
pub(crate) const MAX_LENGTH: f64 = 1e10;
/// Greatest angle, degrees. Larger ones are exporters' errors.
const MAX_DEGREES: f64 = 1e7;

impl Parser<'_> {
    /// A number of file units.
    pub fn length(&self, token: Token) -> Result<f64, BvhError> {
        let value = self.number(token)?;
        if value.abs() > MAX_LENGTH {
            return Err(self.error(token, Kind::Length { found: shown_name(token.text) }));
        }
        Ok(value)
    }

    /// A value of the motion table.
    pub fn value(&self, token: Token, channel: Channel) -> Result<f64, BvhError> {
        if let Channel::Position(_) = channel {
            return self.length(token);
        }
        let value = self.number(token)?;
        if value.abs() > MAX_DEGREES {
            return Err(self.error(token, Kind::Angle { found: shown_name(token.text) }));
        }
        Ok(value)
    }

    pub fn number(&self, token: Token) -> Result<f64, BvhError> {
        let found = || shown_name(token.text);
        match token.text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(_) if token.text.contains(|c: char| c.is_ascii_digit()) => {
                Err(self.error(token, Kind::Overflow { found: found() }))
            }
            Ok(_) => Err(self.error(token, Kind::NotFinite { found: found() })),
            // Old C libraries print these.
            Err(_)
                if token.text.contains("#IND")
                    || token.text.contains("#QNAN")
                    || token.text.contains("#INF") =>
            {
                Err(self.error(token, Kind::NotFinite { found: found() }))
            }
            Err(_)
                if token.text.contains(',')
                    && token.text.replace(',', ".").trim_end_matches('.').split('.').all(is_digits) =>
            {
                Err(self.error(token, Kind::CommaDecimal { found: found() }))
            }
            Err(_) => Err(self.error(token, Kind::NotANumber { found: found() })),
        }
    }
}

fn is_digits(part: &str) -> bool {
    let part = part.trim_start_matches(['-', '+']);
    part.chars().all(|c| c.is_ascii_digit() || matches!(c, 'e' | 'E' | '-' | '+'))
}
