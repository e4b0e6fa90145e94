//! Metres on Earth.

/// Metres per degree of latitude and of longitude at a latitude, from the radii of curvature of the WGS 84 ellipsoid: a plane that touches it there. A
/// kilometre away it is off by millimetres.
pub fn metres_per_degree(latitude_deg: f64) -> (f64, f64) {
    let (a, e2) = (6_378_137.0, 6.694_379_990_14e-3);
    let latitude = latitude_deg.to_radians();
    let sin = libm::sin(latitude);
    let w2 = 1.0 - e2 * sin * sin;
    let along_meridian = a * (1.0 - e2) / (w2 * libm::sqrt(w2));
    let across = a / libm::sqrt(w2) * libm::cos(latitude);
    (along_meridian.to_radians(), across.to_radians())
}
