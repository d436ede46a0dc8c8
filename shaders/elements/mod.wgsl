// What all elements share.

// Hexahedra in a block, and fibre lines in a group.
const LANES: u32 = 16u;
