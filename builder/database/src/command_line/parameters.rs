//! The core's table of parameters as options of a command line.

use anyhow::{Result, bail};
use clap::{
    Arg, ArgMatches, Args, Command, FromArgMatches,
    builder::{PossibleValuesParser, TypedValueParser},
    value_parser,
};
use gestus_core::{
    Config, Method,
    config::parameters::{self, Parameter, TABLE},
};

/// Parameters whose options are written by hand, since they do more than set a value.
const BY_HAND: [u16; 4] = [parameters::RIDGE, parameters::TIMING, parameters::METHOD, parameters::CONTACTS];

/// The parameters given on a command line, by number.
#[derive(Clone, Debug)]
pub struct ParameterArgs(Vec<(&'static Parameter, f32)>);

/// The parameters with an option generated from the table.
pub fn options() -> impl Iterator<Item = &'static Parameter> {
    TABLE.iter().filter(|p| !BY_HAND.contains(&p.number))
}

/// A parameter's option without its dashes: its name without the unit.
pub fn option(parameter: &Parameter) -> String {
    let name = parameter.name;
    name.strip_suffix("_s").or(name.strip_suffix("_m")).unwrap_or(name).replace('_', "-")
}

/// Names of the methods that use a parameter.
fn methods(parameter: &Parameter) -> String {
    parameter.methods.iter().map(|m| m.name()).collect::<Vec<_>>().join(", ")
}

/// Help of an option: the methods that use the parameter, the table's text, and the default.
fn help(parameter: &Parameter) -> String {
    let every = parameter.methods.len() == Method::ALL.len();
    let method = if every { String::new() } else { format!("{}: ", methods(parameter)) };
    let text = parameter.doc.split_whitespace().collect::<Vec<_>>().join(" ");
    let text = text.replace("[`", "`").replace("`]", "`");
    let default = parameter.default();
    match parameter.choices.get(default as usize) {
        Some(_) => format!("{method}{text}"),
        None => format!("{method}{text} From {} [default: {default}]", parameter.range),
    }
}

/// The options and subcommands of a command that a page does not name, such as `build --rate`. The table's parameters have
/// a page of their own.
pub fn undocumented(command: &Command, page: &str) -> Vec<String> {
    let parameters: Vec<String> = options().map(option).collect();
    let goes_on = |rest: &str| rest.starts_with(|c: char| c == '-' || c.is_ascii_alphanumeric());
    let has = |words: &str| page.match_indices(words).any(|(at, _)| !goes_on(&page[at + words.len()..]));
    let own = command.get_name();
    let options = command.get_arguments().filter_map(Arg::get_long);
    let missing = options.filter(|&o| !has(&format!("--{o}")) && !parameters.iter().any(|p| p == o));
    let mut missing: Vec<String> = missing.map(|o| format!("{own} --{o}")).collect();
    for subcommand in command.get_subcommands() {
        let name = subcommand.get_name();
        if !has(&format!("{own} {name}")) && !has(&format!("`{name}`")) {
            missing.push(format!("{own} {name}"));
        }
        missing.extend(undocumented(subcommand, page));
    }
    missing
}

impl Args for ParameterArgs {
    fn augment_args(command: Command) -> Command {
        options().fold(command, |command, parameter| {
            let arg = Arg::new(parameter.name).long(option(parameter)).help(help(parameter));
            command.arg(if parameter.choices.is_empty() {
                arg.value_name("NUMBER").value_parser(value_parser!(f32))
            } else {
                let number =
                    |name: String| parameter.choices.iter().position(|c| *c == name).unwrap_or(0) as f32;
                let default = parameter.choices.get(parameter.default() as usize);
                let arg = arg.default_values(default.into_iter().copied());
                arg.value_parser(PossibleValuesParser::new(parameter.choices).map(number))
            })
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for ParameterArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = |p: &'static Parameter| matches.get_one(p.name).map(|&value: &f32| (p, value));
        Ok(Self(options().filter_map(given).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl ParameterArgs {
    /// Whether the option of that name is given.
    pub fn has(&self, name: &str) -> bool {
        self.0.iter().any(|(parameter, _)| option(parameter) == name)
    }

    /// The configuration with the given parameters set.
    ///
    /// # Errors
    /// A value that is out of its range, or a parameter that the method does not use; both name the option.
    pub fn apply(&self, mut config: Config) -> Result<Config> {
        for &(parameter, value) in &self.0 {
            if let Some(method) = unused(parameter, config.method) {
                bail!(
                    "--{} does nothing without --method {method}: give both, or neither",
                    option(parameter)
                );
            }
            config = match parameters::set(config, parameter.number, value) {
                Ok(config) if parameter.range.contains(value) => config,
                Err(_) if parameter.range.contains(value) => {
                    bail!("--{} {value}: a whole number from {}", option(parameter), parameter.range)
                }
                _ => bail!("--{} {value}: from {}", option(parameter), parameter.range),
            };
        }
        Ok(config)
    }
}

/// The methods that use a parameter, if this one does not.
fn unused(parameter: &Parameter, method: Method) -> Option<String> {
    (!parameter.methods.contains(&method)).then(|| methods(parameter))
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        parameters: ParameterArgs,
    }

    fn applied(config: Config, words: &str) -> Result<Config> {
        Line::parse_from(["gestus"].into_iter().chain(words.split_whitespace())).parameters.apply(config)
    }

    #[test]
    fn every_option_sets_its_parameter_within_its_range() {
        for parameter in options().filter(|p| p.choices.is_empty()) {
            let config = Config::new().method(parameter.methods[0]);
            let set = |value: f32| applied(config, &format!("--{}={value}", option(parameter)));
            for end in [parameter.range.least, parameter.range.most] {
                let value = parameters::value(&set(end).unwrap(), parameter.number);
                assert_eq!(value, Some(end), "{}", parameter.name);
            }
            for value in
                [parameter.range.least.next_down().min(-0.5), parameter.range.most.next_up(), f32::NAN]
            {
                let message = set(value).unwrap_err().to_string();
                assert!(message.contains(&option(parameter)), "{message}");
            }
        }
        let message = applied(Config::new(), "--k 8.5").unwrap_err().to_string();
        assert!(message.contains("a whole number from 1 to 64"), "{message}");
        assert_eq!(applied(Config::new(), "--safety hold").unwrap().safety, gestus_core::Safety::Hold);
    }

    #[test]
    fn a_parameter_of_another_method_is_refused() {
        for parameter in options() {
            for method in Method::ALL {
                let value =
                    parameter.choices.first().map_or(parameter.default().to_string(), |c| (*c).to_owned());
                let line = format!("--{}={value}", option(parameter));
                let done = applied(Config::new().method(method), &line);
                assert_eq!(done.is_ok(), parameter.methods.contains(&method), "{line} {method:?}");
            }
        }
    }
}
