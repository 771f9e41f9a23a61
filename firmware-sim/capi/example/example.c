// Gestus from C: a recorded stream through the library, on any machine.
//
// A recording (firmware-sim/src/recording.rs) holds poses, settings that change on the way, and the digest that the
// host's build of the same core has made of them. That the digest here is the same means that every bit of every pose
// is. On a real board the poses would come from a sensor or a link; the calls are these.

#include "example.h"

#include "../include/gestus.h"

// All the memory that Gestus uses, named and sized where one can see it. Words of 64 bits make it aligned.
static uint64_t database_memory[GESTUS_DATABASE_BYTES / sizeof(uint64_t)];
static uint64_t stylizer_memory[GESTUS_STANDARD_BYTES / sizeof(uint64_t)];

// One frame of a recording, in front of its position and rotations.
struct settings {
  int16_t action;
  int16_t input_style;
  uint16_t styles[2];
  float weights[2];
};

enum { HEADER_BYTES = 24, MAX_JOINTS = 22, NOT_SET = -2 };

static void say_hex(uint32_t number) {
  char text[9];
  for (int i = 0; i < 8; i++)
    text[i] = "0123456789abcdef"[number >> (28 - 4 * i) & 15];
  text[8] = 0;
  say(text);
}

static int failed(const char *what, enum GestusStatus status) {
  say(what);
  say(": ");
  say(gestus_error_message(status));
  say("\n");
  return 1;
}

// Copies bytes: a recording may lie at any address, and not every processor reads a float from there.
static void copy(void *to, const uint8_t *from, size_t bytes) {
  for (size_t i = 0; i < bytes; i++)
    ((uint8_t *)to)[i] = from[i];
}

static uint32_t number_at(const uint8_t *from) {
  uint32_t number;
  copy(&number, from, sizeof number);
  return number;
}

static int same(const void *a, const void *b, size_t bytes) {
  for (size_t i = 0; i < bytes; i++)
    if (((const uint8_t *)a)[i] != ((const uint8_t *)b)[i])
      return 0;
  return 1;
}

static enum GestusStatus set(GestusStylizer *stylizer, const struct settings *wanted) {
  enum GestusStatus status = gestus_stylizer_set_style(stylizer, wanted->styles, wanted->weights, 2);
  if (status == GESTUS_STATUS_OK)
    status = gestus_stylizer_set_labels(stylizer, wanted->action, wanted->input_style);
  return status;
}

int stylize(const uint8_t *blob, size_t blob_bytes, const uint8_t *recording, size_t recording_bytes) {
  GestusDatabase *database;
  GestusStylizer *stylizer;
  GestusBlobDetail detail;
  GestusCounts counts;
  GestusReport report;
  enum GestusStatus status;

  // A blob that was cut is refused, and it is said where.
  status = gestus_database_open(database_memory, sizeof database_memory, blob, blob_bytes - 1, &detail, &database);
  if (status != GESTUS_STATUS_BLOB_TRUNCATED || detail.need != blob_bytes)
    return failed("a blob that was cut is not refused as it should be", status);

  status = gestus_database_open(database_memory, sizeof database_memory, blob, blob_bytes, &detail, &database);
  if (status != GESTUS_STATUS_OK)
    return failed("the blob is refused", status);
  status = gestus_database_counts(database, &counts);
  if (status != GESTUS_STATUS_OK)
    return failed("the counts can't be had", status);
  status = gestus_stylizer_init(stylizer_memory, sizeof stylizer_memory, GESTUS_PROFILE_STANDARD, database, NULL,
                                &stylizer);
  if (status != GESTUS_STATUS_OK)
    return failed("the stylizer is refused", status);

  say("gestus ");
  say(gestus_version());
  say(": ");
  for (uint32_t style = 0; style < counts.styles; style++) {
    char name[GESTUS_NAME_BYTES];
    status = gestus_database_name(database, GESTUS_KIND_STYLE, style, name, sizeof name, NULL);
    if (status != GESTUS_STATUS_OK)
      return failed("a style has no name", status);
    say(style ? ", " : "styles ");
    say(name);
  }
  say("\n");

  size_t joints = counts.joints;
  size_t pose_bytes = (3 + 4 * joints) * sizeof(float);
  size_t frame_bytes = sizeof(struct settings) + pose_bytes;
  if (recording_bytes < HEADER_BYTES || !same(recording, "GSTREAM1", 8) || joints > MAX_JOINTS ||
      number_at(recording + 12) != joints || recording_bytes != HEADER_BYTES + number_at(recording + 8) * frame_bytes) {
    say("the recording is none, or not on the database's skeleton\n");
    return 1;
  }

  uint32_t digest = 0;
  struct settings before = {.action = NOT_SET};
  for (const uint8_t *frame = recording + HEADER_BYTES; frame < recording + recording_bytes; frame += frame_bytes) {
    struct settings settings;
    float position[3], rotations[MAX_JOINTS][4];
    copy(&settings, frame, sizeof settings);
    copy(position, frame + sizeof settings, sizeof position);
    copy(rotations, frame + sizeof settings + sizeof position, pose_bytes - sizeof position);
    if (!same(&settings, &before, sizeof settings)) {
      status = set(stylizer, &settings);
      if (status != GESTUS_STATUS_OK)
        return failed("a setting is refused", status);
      before = settings;
    }
    // In place: the output takes the input's memory.
    status = gestus_stylizer_step(stylizer, position, rotations[0], joints, position, rotations[0], &report);
    if (status != GESTUS_STATUS_OK)
      return failed("a step is refused", status);
    status = gestus_digest(&digest, position, rotations[0], joints, report.step_s);
    if (status != GESTUS_STATUS_OK)
      return failed("a pose has no digest", status);
  }

  // Whoever goes on with a handle that was closed is told so.
  gestus_stylizer_close(stylizer);
  if (gestus_stylizer_reset(stylizer) != GESTUS_STATUS_HANDLE) {
    say("a stale handle is not recognised\n");
    return 1;
  }
  gestus_database_close(database);

  uint32_t expected = number_at(recording + 16);
  say("digest ");
  say_hex(digest);
  say(digest == expected ? ", the host's\n" : ", and the host's is ");
  if (digest != expected) {
    say_hex(expected);
    say("\n");
  }
  return digest != expected;
}
