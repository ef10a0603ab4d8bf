//! How much memory this device gives a page.

use js_sys::{Reflect, global};

/// Memory of a device, roughly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Memory {
    /// A phone, or a computer of up to 4 GB.
    Small,
    /// What is to be expected where the browser does not say.
    Usual,
    /// 8 GB at least.
    Large,
}

/// What the browser says of this device, or else what its screen suggests.
pub(crate) fn memory() -> Memory {
    // Gigabytes; not every browser says it.
    let gigabytes = number("navigator", "deviceMemory");
    let shorter = number("screen", "width").zip(number("screen", "height")).map(|(width, height)| width.min(height));
    let is_phone = shorter.is_some_and(|pixels| pixels < 600.0);
    match gigabytes {
        Some(gigabytes) if gigabytes <= 4.0 => Memory::Small,
        None if is_phone => Memory::Small,
        Some(gigabytes) if gigabytes >= 8.0 && !is_phone => Memory::Large,
        _ => Memory::Usual,
    }
}

fn number(of: &str, name: &str) -> Option<f64> {
    let object = Reflect::get(&global(), &of.into()).ok()?;
    Reflect::get(&object, &name.into()).ok()?.as_f64()
}
