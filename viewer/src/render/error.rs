//! Why there is no picture: for the console which graphics interface said what, for people what helps.

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
                "The graphics interface that this address asks for (renderer=) does not work in this browser. Open the \
                 page without it, and the viewer takes what works."
            }
            Self::Nothing { .. } => {
                "This browser gives the page no 3D graphics. Switch on graphics (hardware) acceleration in the browser's \
                 settings, update the graphics driver, or open the page in a current Chrome, Edge, Firefox or Safari; \
                 then reload."
            }
            Self::Lost(_) => {
                "The graphics processor stopped again and again. Close other programs that use it, update its driver, \
                 then reload."
            }
            Self::Page(_) => {
                "The page's drawing area was changed from outside, perhaps by an extension. Reload the page."
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
