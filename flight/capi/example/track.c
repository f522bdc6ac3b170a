// Finds the attitude of the first image, and follows it through the others: track CATALOG IMAGES.
// IMAGES are of 1024 x 1024 pixels of 16 bits, one after the other, a quarter of a second apart.
#include "starpipe.h"
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define SIDE 1024
static unsigned char catalog[1 << 21], memory[1 << 18];
static uint16_t pixels[SIDE * SIDE];
static starpipe_spot stars[64];

static int failed(const char *what, int error) {
    fprintf(stderr, "%s: %s\n", what, starpipe_error_text(error));
    return 1;
}

static void print_bits(const char *before, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    printf("%s%016" PRIx64, before, bits);
}

int main(int count, char **arguments) {
    if (count != 3) return 2;
    FILE *file = fopen(arguments[1], "rb"), *images = fopen(arguments[2], "rb");
    if (!file || !images) return 2;
    size_t catalog_bytes = fread(catalog, 1, sizeof catalog, file), needed, found;
    fclose(file);

    starpipe_config config = {
        .camera = {.width_px = SIDE, .height_px = SIDE, .focal_length_px = 3640.0,
                   .center_px = {515.3, 507.8}, .radial = {-0.05, 0.01, 0.0}},
        .sensor = {.zero_point_mag = 16.6, .exposure_s = 0.2, .gain_e_per_adu = 2.0, .read_noise_e = 8.0,
                   .background_e_s = 100.0, .saturation_adu = 4095.0},
        .spot_sigma_px = 0.9, .detection_sigma = 5.0, .position_floor_px = 0.005, .scale_error = 1e-4,
        .max_log10_false_alarm = -7.0, .max_stars = 64};
    starpipe_sky sky = {.year = 2026.0, .velocity_km_s = {20.0, -15.0, 8.0}};
    starpipe_budget budget = {.triangles = 2000, .candidates = 200000, .attitudes = 2000};
    starpipe_image image = {pixels, 16, SIDE, SIDE, SIDE};
    starpipe_tracker *tracker;
    starpipe_attitude attitude;

    int error = starpipe_size(&config, catalog, catalog_bytes, &needed);
    if (error) return failed("size", error);
    error = starpipe_init(memory, sizeof memory, &config, catalog, catalog_bytes, &tracker);
    if (error) return failed("init", error);
    fprintf(stderr, "starpipe %s: %zu bytes of memory\n", starpipe_version(), needed);

    for (int number = 0; fread(pixels, sizeof pixels, 1, images) == 1; number++) {
        double time_s = 0.25 * number;
        if ((error = starpipe_track(tracker, &image, time_s, &sky, &attitude))) return failed("track", error);
        const char *way = "tracked";
        if (attitude.status != starpipe_status_FOUND) {
            way = "lost";
            if ((error = starpipe_detect(tracker, &image, stars, 64, &found))) return failed("detect", error);
            if ((error = starpipe_lost(tracker, stars, found, &sky, &budget, &attitude))) return failed("lost", error);
            if ((error = starpipe_start(tracker, &attitude, time_s))) return failed("start", error);
        }
        printf("%d %s %s, %u stars:", number, way, starpipe_status_text(attitude.status), attitude.stars);
        for (int part = 0; part < 4; part++) print_bits(" ", attitude.quaternion[part]);
        for (int axis = 0; axis < 3; axis++) print_bits(axis ? " " : ", ", attitude.covariance_rad2[axis][axis]);
        printf("\n");
    }
    fclose(images);
    return 0;
}
