//! Disjoint sets of indices (union-find); the lowest index represents its set.

/// The representative of the set that holds `index`.
pub(super) fn root_of(parents: &mut [u32], mut index: u32) -> u32 {
    while parents[index as usize] != index {
        let grandparent = parents[parents[index as usize] as usize];
        parents[index as usize] = grandparent;
        index = grandparent;
    }
    index
}

/// Joins the sets that hold `a` and `b`.
pub(super) fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root_of(parents, a), root_of(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}

/// Makes each of `count` indices a set of its own.
pub(super) fn reset(parents: &mut Vec<u32>, count: usize) {
    parents.clear();
    parents.extend(0..count as u32);
}
