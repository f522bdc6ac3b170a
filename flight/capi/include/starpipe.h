// starpipe: star identification, attitude and tracking in memory that the caller gives.
//
// Every function is reentrant and returns STARPIPE_OK or an error. None allocates, starts a thread or opens a file.
// Made by cbindgen from the Rust sources: see README.md.

#ifndef STARPIPE_H
#define STARPIPE_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

// All went well.
#define STARPIPE_OK 0

// A value of the configuration is out of range.
#define STARPIPE_CONFIG 1

// The lens shows two directions in one place within the frame.
#define STARPIPE_LENS 2

// The catalogue is none of this version, or is cut short.
#define STARPIPE_CATALOG 3

// The catalogue is damaged.
#define STARPIPE_CATALOG_HASH 4

// The block of memory is too small.
#define STARPIPE_MEMORY 5

// The image is not of the camera's size.
#define STARPIPE_IMAGE 6

// The time is not later than that of the image before.
#define STARPIPE_TIME 7

// A pointer is null.
#define STARPIPE_NULL 8

// A fault of the library itself: please report it.
#define STARPIPE_FAULT 9

// What is kept, in the caller's memory.
typedef struct starpipe_tracker starpipe_tracker;

// A pinhole with radial distortion.
//
// With r the tangent of the angle from the axis, a star is seen at
// `focal_length_px` · r · (1 + `radial[0]` r² + `radial[1]` r⁴ + `radial[2]` r⁶) from `center_px`.
//
// # Reference
// Brown 1966, Photogrammetric Engineering 32, 444.
typedef struct starpipe_camera {
  // Columns.
  uint32_t width_px;
  // Rows.
  uint32_t height_px;
  // Focal length, in pixels.
  double focal_length_px;
  // Where the axis meets the frame.
  double center_px[2];
  // Distortion.
  double radial[3];
  // 1 where the sky is seen as in a mirror, else 0. Camera axes are then those of the picture with x reversed.
  uint32_t mirrored;
} starpipe_camera;

// A detector and an exposure.
typedef struct starpipe_sensor {
  // V magnitude of a star that makes one electron a second.
  double zero_point_mag;
  // Exposure, in seconds.
  double exposure_s;
  // Electrons in a unit of the image (ADU).
  double gain_e_per_adu;
  // Read noise, in electrons.
  double read_noise_e;
  // Electrons of the sky and of the dark current, a second and pixel.
  double background_e_s;
  // Level of the image (ADU) from which on pixels are saturated.
  double saturation_adu;
  // Time from one row to the next where the rows are read one after the other (rolling shutter), in seconds; else 0.
  double row_time_s;
} starpipe_sensor;

// What does not change from image to image.
typedef struct starpipe_config {
  // The camera's geometry.
  struct starpipe_camera camera;
  // The camera's detector.
  struct starpipe_sensor sensor;
  // Standard deviation of a star's image, in pixels.
  double spot_sigma_px;
  // Significance from which on something counts as a star, in standard deviations of the noise.
  double detection_sigma;
  // What the errors of positions lack in theory, on each axis: lens, pixels, catalogue.
  double position_floor_px;
  // Standard error of the focal length, as a share of it.
  double scale_error;
  // log10 of the false-alarm probability that an identification must stay below.
  double max_log10_false_alarm;
  // Most stars of an image.
  uint32_t max_stars;
} starpipe_config;

// Rows of pixels, the upper one first.
typedef struct starpipe_image {
  // The first pixel.
  const void *pixels;
  // Bits of a pixel: 8 or 16, in the byte order of the machine.
  uint32_t bits;
  // Columns.
  uint32_t width;
  // Rows.
  uint32_t height;
  // Pixels from one row to the next.
  uint32_t stride;
} starpipe_image;

// A spot of light.
typedef struct starpipe_spot {
  // Its place.
  double x_px;
  // Its place.
  double y_px;
  // Standard error of the place, on each axis.
  double sigma_px;
  // Its light, in ADU.
  float flux_adu;
  // Its light over the noise.
  float snr;
} starpipe_spot;

// Where and when: what shifts the stars.
typedef struct starpipe_sky {
  // The time as a year, such as 2026.9.
  double year;
  // Velocity relative to the barycentre of the solar system (ICRS), in km/s.
  double velocity_km_s[3];
} starpipe_sky;

// The most work that a search may do.
typedef struct starpipe_budget {
  // Triangles of spots.
  uint32_t triangles;
  // Triangles of the catalogue that these are compared with.
  uint32_t candidates;
  // Attitudes that are tried on all spots.
  uint32_t attitudes;
} starpipe_budget;

// How a search ended. It is a number, so that it may come from a program in another language.
typedef int32_t starpipe_status;
// The attitude is known.
#define starpipe_status_FOUND 0
// There are fewer stars than are needed.
#define starpipe_status_TOO_FEW_STARS 1
// No attitude is sure enough.
#define starpipe_status_NOT_IDENTIFIED 2
// The budget ended before the search.
#define starpipe_status_BUDGET_SPENT 3
// Nothing is known of the attitude of the images before.
#define starpipe_status_NO_ATTITUDE_BEFORE 4

// Where the camera looks.
typedef struct starpipe_attitude {
  // How the search ended; the rest counts only if it is [`Status::FOUND`].
  starpipe_status status;
  // Stars that it rests on.
  uint32_t stars;
  // [w, x, y, z], w ≥ 0: turns a vector of the ICRS into camera axes.
  double quaternion[4];
  // Covariance of a small rotation about the camera's axes, in rad².
  double covariance_rad2[3][3];
  // Rate of the camera about its own axes, in rad/s; zero where none is known.
  double rate_rad_s[3];
  // Standard errors of the rate; infinite where none is known.
  double rate_sigma_rad_s[3];
  // log10 of the probability that chance does as well.
  double log10_false_alarm;
  // Focal length over that of the configuration.
  double scale;
  // Root mean square of the residuals on each axis, in pixels.
  double rms_px;
} starpipe_attitude;

// The work that a call did.
typedef struct starpipe_work_done {
  // Pixels that were filtered.
  uint64_t pixels;
  // Peaks above the threshold.
  uint64_t peaks;
  // Windows around stars.
  uint64_t windows;
  // Steps of centroids and fits.
  uint64_t iterations;
  // Triangles of spots.
  uint32_t triangles;
  // Triangles of the catalogue that these were compared with.
  uint32_t candidates;
  // Attitudes that were tried on all spots.
  uint32_t attitudes;
  // Stars of the catalogue that were seen to be in the frame or not.
  uint64_t stars;
} starpipe_work_done;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Bytes of the block of memory that `starpipe_init` needs.
//
// # Safety
// `config` and `bytes` point to values, `catalog` to `catalog_bytes` bytes, or they are null.
int starpipe_size(const struct starpipe_config *config,
                  const uint8_t *catalog,
                  size_t catalog_bytes,
                  size_t *bytes);

// Begins in a block of memory. `tracker` then points into it; nothing need be freed.
//
// # Safety
// `memory` points to `memory_bytes` bytes that nothing else uses while the tracker is used. The catalogue stays where it
// is, unchanged, for as long. The other pointers point to values. Any of them may be null.
int starpipe_init(void *memory,
                  size_t memory_bytes,
                  const struct starpipe_config *config,
                  const uint8_t *catalog,
                  size_t catalog_bytes,
                  struct starpipe_tracker **tracker);

// Writes the stars of an image to `stars`, the brightest first, and their number to `count`.
//
// # Safety
// `tracker` is that of `starpipe_init`, `image` and its pixels are what it says, `stars` points to `capacity` stars, and
// `count` to a number, or they are null.
int starpipe_detect(struct starpipe_tracker *tracker,
                    const struct starpipe_image *image,
                    struct starpipe_spot *stars,
                    size_t capacity,
                    size_t *count);

// Finds the attitude of stars, the brightest of them first, of which nothing is known. `attitude->status` says whether it
// is found.
//
// # Safety
// `tracker` is that of `starpipe_init`, `stars` points to `count` stars, and the others to values, or they are null.
int starpipe_lost(struct starpipe_tracker *tracker,
                  const struct starpipe_spot *stars,
                  size_t count,
                  const struct starpipe_sky *sky,
                  const struct starpipe_budget *budget,
                  struct starpipe_attitude *attitude);

// Begins to track with an attitude of `starpipe_lost`; `time_s` is that of the middle of its exposure, in seconds.
//
// # Safety
// `tracker` is that of `starpipe_init`, and `attitude` points to one, or they are null.
int starpipe_start(struct starpipe_tracker *tracker,
                   const struct starpipe_attitude *attitude,
                   double time_s);

// Finds the attitude of an image from those before it; `time_s` is that of the middle of its exposure, in seconds.
//
// # Safety
// `tracker` is that of `starpipe_init`, `image` and its pixels are what it says, and the others point to values, or they
// are null.
int starpipe_track(struct starpipe_tracker *tracker,
                   const struct starpipe_image *image,
                   double time_s,
                   const struct starpipe_sky *sky,
                   struct starpipe_attitude *attitude);

// V magnitude at which half of the stars are detected.
//
// # Safety
// Both point to values, or are null.
int starpipe_limit(const struct starpipe_config *config, double *v_mag);

// The work of the last call, and the most work that a call can do: three values, of `starpipe_detect`, of
// `starpipe_lost` with this budget, and of `starpipe_track`.
//
// # Safety
// `tracker` is that of `starpipe_init`, `most` points to three values, and the others to one, or they are null.
int starpipe_work(const struct starpipe_tracker *tracker,
                  const struct starpipe_budget *budget,
                  struct starpipe_work_done *work,
                  struct starpipe_work_done *most);

// The version of the library.
const char *starpipe_version(void);

// What a function returned, in words.
const char *starpipe_error_text(int error);

// The status of an attitude, in words.
const char *starpipe_status_text(starpipe_status status);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* STARPIPE_H */
