//! The page: state, model, camera, renderer and link, held together.
//!
//! | module | what |
//! |---|---|
//! | [`options`] | what the page's address asks for |
//! | [`scene`] | from the state to what a frame shall show |
//! | [`shortcuts`] | what a key does |

pub mod options;
pub mod scene;
pub mod shortcuts;
