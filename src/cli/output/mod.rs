//! Output: results on standard output and in files, messages on standard error.

pub(crate) mod files;
pub(crate) mod master;
pub(crate) mod messages;
pub(crate) mod overwrite;
pub(crate) mod paths;
pub(crate) mod rows;
pub(crate) mod stdout;
