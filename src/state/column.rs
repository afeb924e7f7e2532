//! An array behind its name.

use crate::{error::Result, memory, record::Element, units::Quantity};
use std::{any::Any, ops::Range};

/// An array behind its name: what engines need to move it between host and device.
pub trait Column: Any {
    /// Number of elements.
    fn len(&self) -> usize;
    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Bytes of an element.
    fn stride(&self) -> usize;
    /// Change the length; new elements are zero.
    fn resize(&mut self, len: usize);
    /// Make room for this length.
    ///
    /// # Errors
    /// [`Error::Lacking`](crate::Error::Lacking) if there is none.
    fn reserve(&mut self, len: usize) -> Result<()>;
    /// Member names of a record, empty for plain values.
    fn names(&self, dims: usize) -> &'static [&'static str];
    /// Number of lanes of each member of an element.
    fn widths(&self, dims: usize) -> Vec<usize>;
    /// What the lanes of an element measure; a plain value measures `of`.
    fn quantities(&self, of: Quantity, dims: usize) -> Vec<Quantity>;
    /// Whether elements are whole numbers.
    fn integer(&self) -> bool;
    /// All lanes, element by element.
    fn lanes(&self, dims: usize, sink: &mut dyn FnMut(f64));
    /// Overwrite all elements from lanes.
    fn fill(&mut self, dims: usize, source: &mut dyn FnMut() -> f64);
    /// A copy of some elements.
    fn duplicate(&self, elements: Range<usize>) -> Box<dyn Any>;
    /// Keep these elements alone, in this order.
    fn select(&mut self, elements: &[usize]);
    /// Overwrite elements, from number `first` on, with all of another array of this kind.
    fn overwrite(&mut self, first: usize, content: &dyn Column);
    /// Put another array's content here and hand the old content back; anything but an array of this kind empties it.
    fn replace(&mut self, content: Box<dyn Any>) -> Box<dyn Any>;
}

impl<T: Element> Column for Vec<T> {
    fn len(&self) -> usize {
        self.len()
    }
    fn stride(&self) -> usize {
        size_of::<T>()
    }
    fn resize(&mut self, len: usize) {
        self.resize(len, T::default());
    }
    fn reserve(&mut self, len: usize) -> Result<()> {
        memory::reserve(self, len.saturating_sub(self.len()))
    }
    fn names(&self, dims: usize) -> &'static [&'static str] {
        T::names(dims)
    }
    fn widths(&self, dims: usize) -> Vec<usize> {
        T::widths(dims)
    }
    fn quantities(&self, of: Quantity, dims: usize) -> Vec<Quantity> {
        T::quantities(of, dims)
    }
    fn integer(&self) -> bool {
        T::INTEGER
    }
    fn lanes(&self, dims: usize, sink: &mut dyn FnMut(f64)) {
        self.iter().for_each(|e| e.put(dims, &mut |x| sink(x)));
    }
    fn fill(&mut self, dims: usize, source: &mut dyn FnMut() -> f64) {
        self.iter_mut().for_each(|e| *e = T::take(dims, &mut || source()));
    }
    fn duplicate(&self, elements: Range<usize>) -> Box<dyn Any> {
        Box::new(self[elements].to_vec())
    }
    fn select(&mut self, elements: &[usize]) {
        *self = elements.iter().map(|k| self[*k].clone()).collect();
    }
    fn overwrite(&mut self, first: usize, content: &dyn Column) {
        let content = (content as &dyn Any).downcast_ref::<Vec<T>>().expect("an array of the same kind");
        self[first..first + content.len()].clone_from_slice(content);
    }
    fn replace(&mut self, content: Box<dyn Any>) -> Box<dyn Any> {
        let content = content.downcast::<Vec<T>>().map(|v| *v).unwrap_or_default();
        Box::new(std::mem::replace(self, content))
    }
}
