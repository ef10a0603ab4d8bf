//! Why there is no picture: for the console which graphics interface said what, for people what helps.

use crate::words::t;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// A graphics interface is missing or refuses.
    #[error("{backend} is not available: {reason}")]
    Backend {
        /// `webgpu` or `webgl2`.
        backend: &'static str,
        /// What failed and why.
        reason: String,
    },
    /// A graphics interface is there but does not draw.
    #[error("{backend} failed its self-test: {reason}")]
    SelfTest {
        /// `webgpu` or `webgl2`.
        backend: &'static str,
        /// What the test saw.
        reason: String,
    },
    /// Every interface failed.
    #[error("no 3D graphics in this browser: {webgpu}; {webgl2}")]
    Nothing {
        /// How WebGPU failed.
        webgpu: String,
        /// How WebGL2 failed.
        webgl2: String,
    },
    /// The device is gone; another one may be opened.
    #[error("the graphics device was lost: {0}")]
    Lost(String),
    /// The page does not let itself be changed.
    #[error("the canvas cannot be replaced: {0}")]
    Page(String),
}

impl RenderError {
    /// What the page tells a person: what is wrong, and what helps.
    pub fn advice(&self) -> &'static str {
        match self {
            Self::Backend { .. } | Self::SelfTest { .. } => {
                t!("graphics.backend")
            }
            Self::Nothing { .. } => {
                t!("graphics.nothing")
            }
            Self::Lost(_) => {
                t!("graphics.lost")
            }
            Self::Page(_) => {
                t!("graphics.page")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_are_told_what_helps_and_not_what_the_program_says() {
        let raw = "RequestDeviceError { inner: Core(LimitsExceeded) }".to_owned();
        let errors = [
            RenderError::Backend { backend: "webgpu", reason: raw.clone() },
            RenderError::SelfTest { backend: "webgl2", reason: raw.clone() },
            RenderError::Nothing { webgpu: raw.clone(), webgl2: raw.clone() },
            RenderError::Lost(raw.clone()),
            RenderError::Page(raw),
        ];
        for error in errors {
            assert!(error.to_string().contains("RequestDeviceError"), "the console has it all");
            let advice = error.advice();
            assert!(!advice.contains(['{', '(']) || advice.contains("(hardware)") || advice.contains("(renderer=)"));
            assert!(!advice.contains("RequestDeviceError") && (advice.contains("eload") || advice.contains("Open")));
        }
    }
}
