//! Temporary.
pub const EXEMPT: u32 = u32::MAX;
#[derive(Debug, Default)]
pub struct Coloring { sets: Vec<Vec<u32>>, over: Vec<u32> }
impl Coloring {
    pub fn assign(&mut self, edges: &[[u32; 2]], n: usize) {
        let mut mask = vec![0u64; n];
        self.sets.clear(); self.over.clear();
        for (i, &[a, b]) in edges.iter().enumerate() {
            let m = if a == EXEMPT { 0 } else { mask[a as usize] } | if b == EXEMPT { 0 } else { mask[b as usize] };
            let c = (!m).trailing_zeros() as usize;
            if c == 64 { self.over.push(i as u32); continue; }
            if a != EXEMPT { mask[a as usize] |= 1 << c; }
            if b != EXEMPT { mask[b as usize] |= 1 << c; }
            if self.sets.len() <= c { self.sets.resize(c + 1, Vec::new()); }
            self.sets[c].push(i as u32);
        }
    }
    pub fn colors(&self) -> impl Iterator<Item = &[u32]> { self.sets.iter().map(|s| &s[..]) }
    pub fn overflow(&self) -> &[u32] { &self.over }
}
