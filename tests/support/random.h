/*
 * random.h - a small seeded generator for tests: the same numbers in every run.
 */
#ifndef TESTS_RANDOM_H
#define TESTS_RANDOM_H

#include <stddef.h>
#include <stdint.h>

/* State of one stream; not to be shared by threads. */
struct test_random {
    uint64_t state[4];
};

/* Starts a stream. Any seed is good, neighbouring seeds give unrelated streams. */
struct test_random test_random_seed(uint64_t seed);

/* 64 random bits. */
uint64_t test_random_bits(struct test_random *random);

/* An integer in [0, bound), bound > 0, without bias that a test could see. */
size_t test_random_below(struct test_random *random, size_t bound);

/* Uniform in [low, high). */
double test_random_uniform(struct test_random *random, double low, double high);

/* Normal with mean 0 and variance 1. */
double test_random_normal(struct test_random *random);

/* n independent normal numbers. */
void test_random_normals(struct test_random *random, size_t n, double *out);

/* A unit vector, uniform on the sphere. */
void test_random_direction(struct test_random *random, double out[3]);

#endif
