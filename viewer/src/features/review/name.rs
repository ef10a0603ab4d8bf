//! Names of reviews, made by the page: sending a review again under its name is harmless.

use semascan_model::review::ReviewId;
use uuid::Builder;

/// A name that no other review has.
pub fn new_name() -> ReviewId {
    let mut bytes = [0; 16];
    let filled = web_sys::window().and_then(|window| window.crypto().ok());
    let is_random = filled.is_some_and(|crypto| crypto.get_random_values_with_u8_array(&mut bytes).is_ok());
    if !is_random {
        // A page without a source of randomness, which no browser of today is.
        bytes = std::array::from_fn(|_| (js_sys::Math::random() * 256.0) as u8);
    }
    ReviewId(Builder::from_random_bytes(bytes).into_uuid())
}
