// What the example needs from the machine that it runs on: host.c and mps2.c have it.
#ifndef GESTUS_EXAMPLE_H
#define GESTUS_EXAMPLE_H

#include <stddef.h>
#include <stdint.h>

// Writes a text that ends with a zero.
void say(const char *text);

// Streams a recording through the library, and says the digest of what comes out. Answers 0 where it is the one that
// the recording carries.
int stylize(const uint8_t *blob, size_t blob_bytes, const uint8_t *recording, size_t recording_bytes);

#endif
