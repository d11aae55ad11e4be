//! Temporary.
use crate::shapes::Aabb;
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BroadPhaseKind { HashGrid, AllPairs }
#[derive(Clone, Copy, Debug)]
pub struct Proxy { pub aabb: Aabb, pub body: u32, pub group: i32, pub dynamic: bool }
#[derive(Debug)]
pub struct BroadPhase;
impl BroadPhase {
    pub fn new(_: BroadPhaseKind) -> Self { BroadPhase }
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        out.clear();
        for i in 0..proxies.len() { for j in i + 1..proxies.len() {
            let (p, q) = (&proxies[i], &proxies[j]);
            if p.aabb.overlaps(&q.aabb) && p.body != q.body && (p.dynamic || q.dynamic) && !(p.group != 0 && p.group == q.group) { out.push([i as u32, j as u32]); }
        }}
    }
}
