//! Writers for point clouds and scenes, the same code in agent and browser.
