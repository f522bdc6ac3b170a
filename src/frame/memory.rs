//! A limit on the memory that a frame takes.

/// How much memory a frame may take while it is read and solved. What a header asks for is checked
/// before it is allocated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryLimit {
    bytes: u64,
}

impl MemoryLimit {
    /// The limit unless another is set: 1.5 GB.
    pub const DEFAULT: Self = Self {
        bytes: 1_500_000_000,
    };

    /// A limit of this many bytes.
    pub const fn of_bytes(bytes: u64) -> Self {
        Self { bytes }
    }

    /// The limit in bytes.
    pub const fn bytes(self) -> u64 {
        self.bytes
    }
}

impl Default for MemoryLimit {
    fn default() -> Self {
        Self::DEFAULT
    }
}
