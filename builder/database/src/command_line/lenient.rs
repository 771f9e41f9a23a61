//! What the options of both commands have in common: negative numbers, and spaces in lists.

use std::{any::TypeId, ffi::OsStr};

use clap::{
    Arg, Command, Error,
    builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser, ValueParser},
};

/// Makes an option accept negative numbers, so that they are refused with the option's range, and trims the items of a list
/// of words.
pub fn lenient(option: Arg) -> Arg {
    if option.is_positional() || !option.get_action().takes_values() {
        return option;
    }
    let parser = option.get_value_parser();
    let is_list = parser.type_id() == TypeId::of::<String>() && option.get_value_delimiter().is_some();
    let trimmed: Option<ValueParser> = is_list.then(|| match parser.possible_values() {
        Some(words) => Trimmed(PossibleValuesParser::new(words)).into(),
        None => Trimmed(StringValueParser::new()).into(),
    });
    let option = option.allow_negative_numbers(true);
    match trimmed {
        Some(trimmed) => option.value_parser(trimmed),
        None => option,
    }
}

/// A parser that does not see the spaces around a value, as in `--parameters "k, prune"`.
#[derive(Debug, Clone)]
pub struct Trimmed<P>(pub P);

impl<P: TypedValueParser> TypedValueParser for Trimmed<P> {
    type Value = P::Value;

    fn parse_ref(&self, command: &Command, option: Option<&Arg>, value: &OsStr) -> Result<P::Value, Error> {
        let trimmed = value.to_str().map_or(value, |value| OsStr::new(value.trim()));
        self.0.parse_ref(command, option, trimmed)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        self.0.possible_values()
    }
}
