//! stub
use super::Proxy;
/// stub
#[derive(Clone, Debug, Default)]
pub struct Tree;
impl Tree {
    /// stub
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        super::all_pairs(proxies, out)
    }
}
