//! Lists of named values, as options and the specifications of faults have them: `proud=1,old=0.5`.

use std::{collections::BTreeSet, ops::RangeBounds, str::FromStr};

use thiserror::Error;

/// An item that can't be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ListError {
    #[error("`{item}`: write NAME=VALUE; the value is {expected}")]
    Missing { item: String, expected: String },
    #[error("{name} is `{value}`, not {expected}")]
    Value { name: String, value: String, expected: String },
    #[error("there is no `{name}`; the names are {expected}")]
    Name { name: String, expected: String },
    #[error("`{list}` has no effect: give one of {expected}")]
    Nothing { list: String, expected: String },
    #[error("`{name}` is given twice")]
    Twice { name: String },
}

/// One item of a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Item<'a> {
    /// All of it.
    pub text: &'a str,
    /// What stands before the last `=`, or all of it.
    pub name: &'a str,
    /// What stands behind the last `=`.
    pub value: Option<&'a str>,
}

/// The items of a list that are not empty, without the spaces around them.
pub fn items(list: &str) -> impl Iterator<Item = Item<'_>> {
    list.split(',').map(Item::new).filter(|item| !item.text.is_empty())
}

/// Refuses a name that comes twice, of which one would be ignored.
///
/// # Errors
/// [`ListError::Twice`].
pub fn check_once<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<(), ListError> {
    let mut before = BTreeSet::new();
    match names.into_iter().map(str::trim).find(|&name| !before.insert(name)) {
        Some(name) => Err(ListError::Twice { name: name.to_owned() }),
        None => Ok(()),
    }
}

/// Most items that a message names.
pub(crate) const NAMED: usize = 3;

/// The first items of a list, and how many `more` there are; `None` where there is none.
pub(crate) fn first_of(items: impl IntoIterator<Item = String>, more: &str) -> Option<String> {
    let mut list: Vec<String> = items.into_iter().collect();
    let count = list.len();
    if count > NAMED {
        list.truncate(NAMED);
        list.push(format!("{} {more}", count - NAMED));
    }
    (count > 0).then(|| list.join(", "))
}

/// Refuses a list of faults that has none: nothing, or the `seed` of their random numbers alone. `expected` are the faults.
///
/// # Errors
/// [`ListError::Nothing`].
pub fn check_faults(list: &str, expected: &str) -> Result<(), ListError> {
    if items(list).any(|item| item.name != "seed") {
        return Ok(());
    }
    Err(ListError::Nothing { list: list.to_owned(), expected: expected.to_owned() })
}

impl<'a> Item<'a> {
    /// Splits one item.
    pub fn new(text: &'a str) -> Self {
        let text = text.trim();
        match text.rsplit_once('=') {
            Some((name, value)) => Self { text, name: name.trim(), value: Some(value.trim()) },
            None => Self { text, name: text, value: None },
        }
    }

    /// The value; `expected` describes it.
    ///
    /// # Errors
    /// [`ListError::Missing`].
    pub fn value(&self, expected: &str) -> Result<&'a str, ListError> {
        self.value.ok_or_else(|| self.missing(expected))
    }

    /// The two halves of a value with a `:`, as in `delay=0.1:3`; `expected` describes both.
    ///
    /// # Errors
    /// [`ListError::Missing`].
    pub fn pair(&self, expected: &str) -> Result<(&'a str, &'a str), ListError> {
        self.value(expected)?.split_once(':').ok_or_else(|| self.missing(expected))
    }

    /// The value as a number within a range; `expected` describes both.
    ///
    /// # Errors
    /// [`ListError::Missing`] and [`ListError::Value`].
    pub fn number<T>(&self, range: impl RangeBounds<T>, expected: &str) -> Result<T, ListError>
    where
        T: FromStr + PartialOrd,
    {
        self.parse(self.value(expected)?, range, expected)
    }

    /// A part of the value as a number within a range; `expected` describes both.
    ///
    /// # Errors
    /// [`ListError::Value`].
    pub fn parse<T>(&self, value: &str, range: impl RangeBounds<T>, expected: &str) -> Result<T, ListError>
    where
        T: FromStr + PartialOrd,
    {
        let number = value.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| self.bad(value, expected))
    }

    /// The value as a weight, 1 where there is none. Any number, since what a weight may be is its user's to say.
    ///
    /// # Errors
    /// [`ListError::Value`].
    pub fn weight<T: FromStr>(&self) -> Result<T, ListError> {
        let value = self.value.unwrap_or("1");
        value.parse().map_err(|_| self.bad(value, "a number, as in proud=0.5"))
    }

    /// The error of a name that is not among `names`.
    pub fn unknown(&self, names: &str) -> ListError {
        ListError::Name { name: self.name.to_owned(), expected: names.to_owned() }
    }

    fn bad(&self, value: &str, expected: &str) -> ListError {
        let (name, value, expected) = (self.name.to_owned(), value.to_owned(), expected.to_owned());
        ListError::Value { name, value, expected }
    }

    fn missing(&self, expected: &str) -> ListError {
        ListError::Missing { item: self.text.to_owned(), expected: expected.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_have_names_and_values() {
        let read: Vec<_> = items(" proud = 1,, old,d=1=0.5 ,").map(|i| (i.text, i.name, i.value)).collect();
        assert_eq!(
            read,
            [("proud = 1", "proud", Some("1")), ("old", "old", None), ("d=1=0.5", "d=1", Some("0.5"))]
        );
        assert_eq!(Item::new("a").weight::<f32>(), Ok(1.0));
        assert_eq!(Item::new("a=-2").weight::<f64>(), Ok(-2.0));
        assert_eq!(Item::new("delay=0.1:3").pair("two"), Ok(("0.1", "3")));
    }

    #[test]
    fn errors_say_what_is_expected() {
        let unit = |text: &str| Item::new(text).number(0.0..=1.0, "from 0 to 1").unwrap_err();
        assert!(matches!(unit("a"), ListError::Missing { .. }));
        for text in ["a=x", "a=", "a=2", "a=nan"] {
            assert!(matches!(unit(text), ListError::Value { .. }), "{text}");
        }
        assert!(matches!(Item::new("a=1").pair("two"), Err(ListError::Missing { .. })));
        assert!(matches!(Item::new("a=x").weight::<f32>(), Err(ListError::Value { .. })));
        assert!(matches!(Item::new("c=1").unknown("a, b"), ListError::Name { name, .. } if name == "c"));
    }
}
