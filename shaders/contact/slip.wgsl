// Accumulated slip of contact points since the start.

#if ROOT
fn slip(item: u32) {
    slipped[item] = slipped[item] + sums[SUMS * item + SUM_SLIP];
}
#endif
