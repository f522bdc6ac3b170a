//! Where does a camera point that sees a triangle of the catalogue as it is observed? (TRIAD)

use nalgebra::{Matrix3, Vector3};

/// An observed triangle beside those of the catalogue: an orthonormal frame of it in the camera, not
/// mirrored and mirrored.
#[derive(Debug, Clone, Copy)]
pub struct InCamera {
    pub frames: [Matrix3<f64>; 2],
    /// Triple product of its unit vectors.
    pub triple: f64,
}

/// A frame of a triangle in the camera and the same in the sky: where the camera points (TRIAD).
pub struct AlignedTriangle<'a> {
    /// Whether the x axis is reversed.
    pub mirrored: bool,
    /// The frame in the camera.
    pub of_camera: &'a Matrix3<f64>,
    /// The frame in the sky.
    pub of_sky: Matrix3<f64>,
}

impl InCamera {
    /// The triangle of these unit vectors.
    pub fn new(vectors: &[Vector3<f64>; 3]) -> Option<Self> {
        let mirrored = vectors.map(|v| Vector3::new(-v.x, v.y, v.z));
        Some(Self {
            frames: [frame_of(vectors)?, frame_of(&mirrored)?],
            triple: triple(vectors),
        })
    }

    /// The triangle aligned with that of the catalogue whose stars have these unit vectors.
    #[inline]
    pub fn aligned(&self, sky: &[Vector3<f64>; 3]) -> Option<AlignedTriangle<'_>> {
        let mirrored = self.triple * triple(sky) < 0.0;
        Some(AlignedTriangle {
            mirrored,
            of_camera: &self.frames[usize::from(mirrored)],
            of_sky: frame_of(sky)?,
        })
    }
}

/// An orthonormal frame of a triangle: the middle of AB, and the normal to AB.
fn frame_of([a, b, _]: &[Vector3<f64>; 3]) -> Option<Matrix3<f64>> {
    let first = (a + b).try_normalize(1e-12)?;
    let third = a.cross(b).try_normalize(1e-15)?;
    Some(Matrix3::from_columns(&[first, third.cross(&first), third]))
}

/// The triple product of three vectors.
fn triple([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    a.cross(b).dot(c)
}
