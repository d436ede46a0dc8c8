//! Work space that a thread keeps from one chunk to the next, by type.

use std::any::Any;
use std::cell::RefCell;

thread_local! {
    static KEPT: RefCell<Vec<Box<dyn Any>>> = const { RefCell::new(Vec::new()) };
}

/// The work space of a type that this thread has put back, else a new one.
pub fn take<T: Default + 'static>() -> Box<T> {
    KEPT.with_borrow_mut(|kept| {
        let place = kept.iter().position(|space| space.is::<T>());
        place.and_then(|place| kept.swap_remove(place).downcast().ok()).unwrap_or_default()
    })
}

/// Keeps a work space for the next chunk.
pub fn put_back<T: 'static>(space: Box<T>) {
    KEPT.with_borrow_mut(|kept| kept.push(space));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_gets_back_what_it_put_back() {
        let mut numbers = take::<Vec<f32>>();
        numbers.push(1.0);
        put_back(numbers);
        put_back(take::<Vec<f64>>());
        assert_eq!(*take::<Vec<f32>>(), [1.0]);
        assert!(take::<Vec<f32>>().is_empty(), "it was taken");
        assert!(std::thread::spawn(|| take::<Vec<f64>>().is_empty()).join().expect("no panic"));
    }
}
