//! Insertion into a short sorted list.

use heapless::Vec;

/// Inserts an item after those for which `goes_before` is true, and returns its index.
///
/// If the list already has `most` items (1 to its capacity), the last one is dropped; or, if that would be the new item, the
/// list does not change and the index is `most`.
// Searches from the end, since items often arrive nearly in order. `Vec::insert` is not used, because its `memmove`
// takes 1.6 KB on a microcontroller.
#[inline]
pub(crate) fn insert<T: Copy, const N: usize>(
    list: &mut Vec<T, N>,
    most: usize,
    item: T,
    goes_before: impl Fn(&T) -> bool,
) -> usize {
    if list.len() < most {
        let _ = list.push(item);
    } else if list.last().is_some_and(&goes_before) {
        return list.len();
    }
    let mut slots = list.iter_mut().rev();
    let Some(mut free) = slots.next() else { return 0 };
    while let Some(slot) = slots.next() {
        let other = *slot;
        if goes_before(&other) {
            *free = item;
            return slots.len() + 1;
        }
        *free = other;
        free = slot;
    }
    *free = item;
    0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_stay_in_order_and_equals_as_they_came() {
        let mut list: Vec<(u8, usize), 5> = Vec::new();
        let mut every = std::vec::Vec::new();
        for (i, value) in [7u8, 3, 9, 3, 3, 8, 1, 9, 0, 7, 2].into_iter().enumerate() {
            let at = insert(&mut list, 4, (value, i), |other| other.0 <= value);
            every.push((value, i));
            every.sort();
            assert_eq!(list.as_slice(), &every[..every.len().min(4)], "after {i}");
            assert_eq!(list.get(at).copied().unwrap_or((value, i)), (value, i));
            assert_eq!(at == 4, !every[..every.len().min(4)].contains(&(value, i)));
        }
    }
}
