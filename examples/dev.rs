#![allow(missing_docs, clippy::all)]
use starpipe::catalog::*; use starpipe::catalog::sky_grid::*; use starpipe::coords::*; use starpipe::identify::index::*;
use std::time::Instant;
pub fn stars()->Vec<Star>{ let b=std::fs::read("/tmp/w/stars.bin").unwrap(); b.chunks(32).map(|c|{let f=|o:usize|f64::from_le_bytes(c[o..o+8].try_into().unwrap()); let g=|o:usize|f32::from_le_bytes(c[o..o+4].try_into().unwrap());
 Star{id:StarId(u32::from_le_bytes(c[..4].try_into().unwrap())),direction:UnitVector::from_ra_dec(f(4).to_radians(),f(12).to_radians()),pm_ra_mas_per_yr:g(20),pm_dec_mas_per_yr:g(24),v_mag:g(28),bv_mag:None}}).collect()}
fn main(){ let s=stars(); let t=Instant::now(); let g=SkyGrid::new(&s); println!("grid {:?}",t.elapsed()); let t=Instant::now(); let ix=TriangleIndex::build(&s,&g,&|_|()); println!("build {:?} {}",t.elapsed(),ix.len());
 for c in &ix.classes{println!("{:.2}-{:.2}: {}",c.low.to_degrees(),c.high.to_degrees(),c.corners.len());} 
 let t=Instant::now(); let b=rkyv::to_bytes::<rkyv::rancor::Error>(&ix).unwrap(); println!("ser {:?} {}",t.elapsed(),b.len());
 std::fs::write("/tmp/w/ix.bin",&b).unwrap();
 let t=Instant::now(); let raw=std::fs::read("/tmp/w/ix.bin").unwrap(); println!("read {:?}",t.elapsed()); let h=xxhash_rust::xxh3::xxh3_64(&raw); println!("hash {:?} {h}",t.elapsed());
 let mut al=rkyv::util::AlignedVec::<128>::new(); al.extend_from_slice(&raw); let a=rkyv::access::<rkyv::Archived<TriangleIndex>,rkyv::rancor::Error>(&al).unwrap(); println!("access {:?} {}",t.elapsed(),a.classes.len());
 let t=Instant::now(); let o=rkyv::from_bytes::<TriangleIndex,rkyv::rancor::Error>(&al).unwrap(); println!("owned {:?} {}",t.elapsed(),o.classes.len());
 let mut n=0; let t=Instant::now(); for i in 0..1000{ for c in &ix.classes{ c.for_each_similar([0.6+0.0003*i as f64,0.45+0.0002*i as f64],0.003,|_|n+=1);} } println!("query {:?}/tri {}",t.elapsed()/1000,n/1000);
}
