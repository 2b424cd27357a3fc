//! A lock-free queue between the control interrupt and the background: one end each.
//!
//! Why not `heapless::spsc`: its indices are taken modulo a length known at run time only, which links a division-by-zero
//! panic into the interrupt. Here the length is a power of two and part of the type; `tests/tests/elf.rs` checks the result.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering};

/// The storage. `N` must be a power of two; it holds `N` elements.
pub(crate) struct Ring<T, const N: usize> {
    slots: UnsafeCell<[MaybeUninit<T>; N]>,
    /// Elements ever written and read; they wrap, their difference is the number of elements inside.
    written: AtomicU32,
    read: AtomicU32,
}

// SAFETY: one writer and one reader, enforced by `split`; a slot belongs to the reader from the moment `written` passes it
// (release/acquire) to the moment `read` does.
unsafe impl<T: Send, const N: usize> Sync for Ring<T, N> {}

impl<T, const N: usize> Ring<T, N> {
    const MASK: u32 = {
        assert!(N.is_power_of_two() && N <= 1 << 16);
        N as u32 - 1
    };

    /// Empty.
    pub(crate) const fn new() -> Self {
        Self {
            slots: UnsafeCell::new([const { MaybeUninit::uninit() }; N]),
            written: AtomicU32::new(0),
            read: AtomicU32::new(0),
        }
    }

    /// The two ends.
    pub(crate) fn split(&'static mut self) -> (Writer<T, N>, Reader<T, N>) {
        (Writer(self), Reader(self))
    }

    fn len(&self) -> u32 {
        self.written.load(Ordering::Acquire).wrapping_sub(self.read.load(Ordering::Acquire))
    }

    fn slot(&self, count: u32) -> *mut T {
        // The mask keeps the index inside the array.
        self.slots.get().cast::<T>().wrapping_add((count & Self::MASK) as usize)
    }
}

/// Where elements go in.
pub(crate) struct Writer<T: 'static, const N: usize>(&'static Ring<T, N>);

impl<T, const N: usize> Writer<T, N> {
    /// Puts an element in, or gives it back if the queue is full.
    #[inline]
    pub(crate) fn enqueue(&mut self, element: T) -> Result<(), T> {
        if self.0.len() > Ring::<T, N>::MASK {
            return Err(element);
        }
        let written = self.0.written.load(Ordering::Relaxed);
        // SAFETY: the slot is outside the filled part, and this is the only writer.
        unsafe { self.0.slot(written).write(element) };
        self.0.written.store(written.wrapping_add(1), Ordering::Release);
        Ok(())
    }

    /// Whether everything has been taken out.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.len() == 0
    }
}

/// Where elements come out.
pub(crate) struct Reader<T: 'static, const N: usize>(&'static Ring<T, N>);

impl<T, const N: usize> Reader<T, N> {
    /// Takes the oldest element out after a look at it where it lies: large elements are not copied through the stack. Whether
    /// there was one.
    #[inline]
    pub(crate) fn dequeue_with(&mut self, look: impl FnOnce(&T)) -> bool {
        if self.0.len() == 0 {
            return false;
        }
        let read = self.0.read.load(Ordering::Relaxed);
        let slot = self.0.slot(read);
        // SAFETY: the slot was filled before `written` passed it, and this is the only reader; it is dropped once.
        unsafe {
            look(&*slot);
            slot.drop_in_place();
        }
        self.0.read.store(read.wrapping_add(1), Ordering::Release);
        true
    }

    /// Takes the oldest element out.
    #[inline]
    pub(crate) fn dequeue(&mut self) -> Option<T> {
        if self.0.len() == 0 {
            return None;
        }
        let read = self.0.read.load(Ordering::Relaxed);
        // SAFETY: the slot was filled before `written` passed it, and this is the only reader.
        let element = unsafe { self.0.slot(read).read() };
        self.0.read.store(read.wrapping_add(1), Ordering::Release);
        Some(element)
    }
}
