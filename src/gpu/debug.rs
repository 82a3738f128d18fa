//! Names of objects for debugging tools, and the messages of validation layers.

use ash::vk;
use std::ffi::{CString, c_void};
use std::sync::Mutex;

/// Most messages that are kept; more are only logged.
const MOST_MESSAGES: usize = 1000;

/// Messages of the validation layers, in order of arrival.
pub(crate) type Messages = Mutex<Vec<String>>;

/// Debug-utils functions, if the instance has the extension enabled.
pub(crate) struct DebugUtils {
    pub instance: ash::ext::debug_utils::Instance,
    pub messenger: vk::DebugUtilsMessengerEXT,
    /// Boxed, so that the address given to the messenger stays valid.
    pub messages: Box<Messages>,
}

unsafe extern "system" fn collect(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid callback data, and `user` is the box of `DebugUtils`, which outlives the messenger.
    let (data, messages) = unsafe { (&*data, &*user.cast::<Messages>()) };
    // SAFETY: both are null or C strings for the duration of the call.
    let (id, text) = unsafe { (data.message_id_name_as_c_str(), data.message_as_c_str()) };
    let text = text.map(|t| t.to_string_lossy().into_owned()).unwrap_or_default();
    // The loader reports drivers that it skipped; only the layers' messages matter here.
    if id.is_some_and(|i| i.to_bytes() == b"Loader Message") {
        return vk::FALSE;
    }
    let text = format!("{severity:?}: {text}");
    log::warn!("{text}");
    if let Ok(mut messages) = messages.lock()
        && messages.len() < MOST_MESSAGES
    {
        messages.push(text);
    }
    vk::FALSE
}

impl DebugUtils {
    pub(crate) fn new(entry: &ash::Entry, instance: &ash::Instance) -> Option<Self> {
        let functions = ash::ext::debug_utils::Instance::new(entry, instance);
        let messages = Box::new(Messages::default());
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::GENERAL)
            .pfn_user_callback(Some(collect))
            .user_data((&raw const *messages).cast_mut().cast());
        // SAFETY: the instance has the extension; the messages outlive the messenger, which `Foundation` destroys first.
        let messenger = unsafe { functions.create_debug_utils_messenger(&info, None) }.ok()?;
        Some(Self { instance: functions, messenger, messages })
    }
}

/// Names an object for debuggers and validation messages, if the device has debug-utils.
pub(crate) fn name<T: vk::Handle>(device: Option<&ash::ext::debug_utils::Device>, object: T, name: &str) {
    if let Some(device) = device
        && let Ok(name) = CString::new(name)
    {
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(object).object_name(&name);
        // SAFETY: the object belongs to this device and is alive.
        let _ = unsafe { device.set_debug_utils_object_name(&info) };
    }
}
