//! Requests that change a setting of the stylizer.

use super::{Board, Pairs, Request, server::Handler};
use crate::{ConfigError, config::parameters};

impl<B: Board<J>, const J: usize, const K: usize, const C: usize, const N: usize>
    Handler<'_, '_, B, J, K, C, N>
{
    /// Applies a request that changes a setting; ignores any other.
    #[inline(never)]
    pub(super) fn set(&mut self, request: &Request<'_>) -> Result<(), ConfigError> {
        match *request {
            Request::Style(ref weights) => self.stylizer.set_style(weights),
            Request::Labels { action, input_style } => self.stylizer.set_labels(action, input_style),
            Request::Mask { group, searched } => self.stylizer.set_mask(group, searched),
            Request::Strength(ref strengths) => self.strengths(strengths),
            Request::GroupStyle { group, ref weights } => self.stylizer.set_group_style(group, weights),
            Request::Configure(ref parameters) => self.configure(parameters),
            Request::Reset => {
                self.stylizer.reset();
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Sets all strengths or none.
    #[inline(never)]
    fn strengths(&mut self, strengths: &Pairs) -> Result<(), ConfigError> {
        for &(group, strength) in strengths {
            self.stylizer.check_strength(group, strength)?;
        }
        for &(group, strength) in strengths {
            self.stylizer.set_strength(group, strength)?;
        }
        Ok(())
    }

    #[inline(never)]
    fn configure(&mut self, parameters: &Pairs) -> Result<(), ConfigError> {
        let mut config = *self.stylizer.config();
        for &(number, value) in parameters {
            config = parameters::set(config, number, value)?;
        }
        self.stylizer.set_config(config)
    }
}
