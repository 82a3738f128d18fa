//! Queues protected by a lock, owned by this crate or by the host.

use ash::vk;
use std::sync::{Mutex, PoisonError};

/// A queue, and the lock that the host takes for its own submissions. Implemented for `Mutex<vk::Queue>`; a host with
/// another kind of lock implements it for that.
///
/// # Safety
/// While [`HostQueue::locked`] runs `submit`, no other thread uses the queue.
pub unsafe trait HostQueue: Send + Sync {
    /// Calls `submit` once with the queue, while the lock is held.
    fn locked(&self, submit: &mut dyn FnMut(vk::Queue));
}

// SAFETY: whoever uses the queue has locked the mutex.
unsafe impl HostQueue for Mutex<vk::Queue> {
    fn locked(&self, submit: &mut dyn FnMut(vk::Queue)) {
        // The handle stays valid even if a panic poisoned the lock.
        submit(*self.lock().unwrap_or_else(PoisonError::into_inner));
    }
}
