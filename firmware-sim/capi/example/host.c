// The example on a machine with files: example BLOB RECORDING

#include "example.h"

#include <stdio.h>
#include <stdlib.h>

void say(const char *text) { fputs(text, stdout); }

// Exactly as many bytes as the file has, so that valgrind sees a read beyond.
static uint8_t *load(const char *name, size_t *bytes) {
  FILE *file = fopen(name, "rb");
  uint8_t *content = NULL;
  long length;
  if (file && !fseek(file, 0, SEEK_END) && (length = ftell(file)) > 0 && !fseek(file, 0, SEEK_SET)) {
    *bytes = (size_t)length;
    content = malloc(*bytes);
    if (content && fread(content, 1, *bytes, file) != *bytes) {
      free(content);
      content = NULL;
    }
  }
  if (file)
    fclose(file);
  if (!content)
    fprintf(stderr, "%s can't be read\n", name);
  return content;
}

int main(int count, char **arguments) {
  if (count != 3) {
    fprintf(stderr, "example BLOB RECORDING\n");
    return 2;
  }
  size_t blob_bytes, recording_bytes;
  uint8_t *blob = load(arguments[1], &blob_bytes);
  uint8_t *recording = load(arguments[2], &recording_bytes);
  int status = blob && recording ? stylize(blob, blob_bytes, recording, recording_bytes) : 2;
  free(blob);
  free(recording);
  return status;
}
