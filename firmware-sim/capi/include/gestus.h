// Gestus: motion style transfer for microcontrollers, from C.
//
// Made by cbindgen from firmware-sim/capi/src; don't edit it. `cargo xtask capi` makes it anew.
//
// Everything lies in memory that you give: ask for a size, give that many bytes, get a handle that lies in them.
// Nothing is allocated, and nothing has to be released. Every function answers a GestusStatus, of which
// GESTUS_STATUS_OK is 0; gestus_error_message says what the others mean.
//
//     static uint64_t database_memory[GESTUS_DATABASE_BYTES / 8];
//     static uint64_t stylizer_memory[GESTUS_STANDARD_BYTES / 8];
//     GestusDatabase *database;
//     GestusStylizer *stylizer;
//     gestus_database_open(database_memory, sizeof database_memory, blob, blob_bytes, NULL, &database);
//     gestus_stylizer_init(stylizer_memory, sizeof stylizer_memory, GESTUS_PROFILE_STANDARD, database, NULL,
//                          &stylizer);
//     gestus_stylizer_set_style_name(stylizer, "proud");
//     for (;;) {
//         read_pose(position, rotations);
//         gestus_stylizer_step(stylizer, position, rotations, JOINTS, position, rotations, &report);
//         drive(position, rotations, report.step_s);
//     }
//
// Functions are safe to call with null, misaligned, short and overlapping arguments: they say so and change nothing.
// "Safety" below is what no library can check, and what the caller therefore promises.

#ifndef GESTUS_H
#define GESTUS_H

#include <stddef.h>
#include <stdint.h>

// Bytes that are enough for a database on every target; `gestus_database_size` tells the exact number.
#define GESTUS_DATABASE_BYTES 1024

// Most bytes of a name, with the zero that ends it.
#define GESTUS_NAME_BYTES 256

// Bytes that are enough for a stylizer of the profile `GESTUS_PROFILE_STANDARD`, on every target: for memory that
// has to be declared before the program runs. `gestus_stylizer_size` tells the exact number.
#define GESTUS_STANDARD_BYTES 32768

// The same for `GESTUS_PROFILE_SMALL`.
#define GESTUS_SMALL_BYTES 16384

// The same for `GESTUS_PROFILE_LARGE`.
#define GESTUS_LARGE_BYTES 131072

// Most classes in a report.
#define GESTUS_MOST_CLASSES 8

// The input was no pose (NaN, a quaternion whose length is not within 1% of 1, a place over 100 km off): the last output
// was held, or what `GESTUS_PARAMETER_SAFETY` says.
#define GESTUS_DEGRADED_INPUT 1

// A search used up its visits before it was done.
#define GESTUS_DEGRADED_VISITS 2

// More classes had weight than a frame may use.
#define GESTUS_DEGRADED_CLASSES 4

// A prediction was not finite or far out of range: the input was passed through in its place.
#define GESTUS_DEGRADED_PREDICTION 8

// A class that has weight was searched anew: the input has jumped, or is far from the data.
#define GESTUS_DEGRADED_JUMP 16

// The input moved faster than any body; told where `GESTUS_PARAMETER_SAFETY` is not 0.
#define GESTUS_DEGRADED_LEAP 128

// What a function answers. With any answer but `GESTUS_STATUS_OK` nothing was changed, except as the function says.
typedef enum GestusStatus {
  // It is done.
  GESTUS_STATUS_OK = 0,
  // A pointer is null that must not be.
  GESTUS_STATUS_NULL = 1,
  // A pointer is not aligned to what it points at.
  GESTUS_STATUS_MISALIGNED = 2,
  // Memory or an array is shorter than what is needed, or longer than the address space.
  GESTUS_STATUS_SHORT = 3,
  // Two arguments overlap that must not.
  GESTUS_STATUS_OVERLAP = 4,
  // The handle is none: stale, overwritten, moved, or never made.
  GESTUS_STATUS_HANDLE = 5,
  // The profile is not one of `GestusProfile`, or was left out of this library.
  GESTUS_STATUS_PROFILE = 6,
  // An index or kind is out of range, or there is no such name.
  GESTUS_STATUS_NOT_FOUND = 7,
  // A text is not UTF-8, or longer than `GESTUS_NAME_BYTES` with its final zero.
  GESTUS_STATUS_TEXT = 8,
  // The blob has fewer or more bytes than it says: copy it again, whole.
  GESTUS_STATUS_BLOB_TRUNCATED = 16,
  // The first bytes are not a Gestus blob's.
  GESTUS_STATUS_BLOB_MAGIC = 17,
  // The blob is of another version of the format: build it again.
  GESTUS_STATUS_BLOB_VERSION = 18,
  // A checksum does not agree: the blob was damaged.
  GESTUS_STATUS_BLOB_CHECKSUM = 19,
  // A section is missing, doubled or misplaced.
  GESTUS_STATUS_BLOB_SECTION = 20,
  // A section's length does not follow from the header's counts.
  GESTUS_STATUS_BLOB_LENGTH = 21,
  // A number in a section is out of its range.
  GESTUS_STATUS_BLOB_VALUE = 22,
  // A reserved byte is not zero: the blob is newer than this library, or damaged.
  GESTUS_STATUS_BLOB_RESERVED = 23,
  // The manifest can't be decoded.
  GESTUS_STATUS_BLOB_MANIFEST = 24,
  // The blob is refused for a reason that this library has no number for.
  GESTUS_STATUS_BLOB_OTHER = 31,
  // The database has more joints than the profile takes.
  GESTUS_STATUS_JOINTS = 32,
  // The database has more classes than the profile takes.
  GESTUS_STATUS_CLASSES = 33,
  // The number of neighbors is 0, or more than the profile takes.
  GESTUS_STATUS_NEIGHBORS = 34,
  // There is no style, action, joint group or parameter of that number.
  GESTUS_STATUS_UNKNOWN = 35,
  // The database does not hold the labelled action in the labelled style.
  GESTUS_STATUS_NO_CLASS = 36,
  // A weight is negative or not finite, or all are zero; or there are more styles than 32, or than 3 for a joint group.
  GESTUS_STATUS_WEIGHTS = 37,
  // A parameter is not finite or out of its range.
  GESTUS_STATUS_PARAMETER = 38,
  // The database does not hold what the method needs (frames, linear models or statistics), or the method can't do that:
  // linear models give a style to the whole body alone.
  GESTUS_STATUS_METHOD = 39,
  // The database has no effort dial.
  GESTUS_STATUS_NO_DIAL = 40,
  // The stylizer refuses for a reason that this library has no number for.
  GESTUS_STATUS_SETTING_OTHER = 47,
} GestusStatus;

// Capacities of a stylizer. Arguments named `profile` take one of these numbers.
typedef enum GestusProfile {
  // Up to 22 joints, 40 neighbors a class and 28 classes.
  GESTUS_PROFILE_STANDARD = 0,
  // Up to 12 joints, 16 neighbors a class and 8 classes: toys, and boards with little memory.
  GESTUS_PROFILE_SMALL = 1,
  // Up to 64 joints, 64 neighbors a class and 256 classes, which is any database: for hosts, games and browsers. A
  // library has it where it is built with `--features large`.
  GESTUS_PROFILE_LARGE = 2,
} GestusProfile;

// What has names. Arguments named `kind` take one of these numbers.
typedef enum GestusKind {
  // Joints.
  GESTUS_KIND_JOINT = 0,
  // Styles.
  GESTUS_KIND_STYLE = 1,
  // Actions.
  GESTUS_KIND_ACTION = 2,
  // Joint groups.
  GESTUS_KIND_GROUP = 3,
} GestusKind;

// Policies for the output's time.
typedef enum GestusTiming {
  // Poses carry their predicted time steps: the output runs on its own timeline.
  GESTUS_TIMING_FREE = 0,
  // One pose in, one pose out, at the input's rate.
  GESTUS_TIMING_SYNC = 1,
} GestusTiming;

// Methods of translation. The database has to hold what the method needs.
typedef enum GestusMethod {
  // The mixture of local autoregressive models over the database's frames.
  GESTUS_METHOD_MIXTURE = 0,
  // Linear time-invariant models.
  GESTUS_METHOD_LINEAR = 1,
  // Transfer of means and spreads.
  GESTUS_METHOD_STATISTIC = 2,
} GestusMethod;

// Parameters of a stylizer by number, the same as on the link. Every value is a `float`.
typedef enum GestusParameter {
  // Neighbors of each class that the local models are fitted to. More of them average more: smoother, but each step
  // becomes the same step. Fewer follow the input more closely and are rougher; 40 is the value of Xia 2015. At most
  // the stylizer's `K`. 1 to 64. Default 16.
  GESTUS_PARAMETER_K = 0,
  // Weight λ of the ridge (Xia 2015, section 5.1). Less lets a class's slopes count more, and the output may take
  // longer to forget an error; from about 1 on raw variables it is the neighbors' mean. 0.000000001 to 1000000.
  // Default 0.1.
  GESTUS_PARAMETER_LAMBDA = 1,
  // Variables of the ridge. `norm` is better for pairs that were recorded or made as pairs; with it set λ and the
  // penalty on the feedback too, as `Config::normalised` does. 0 raw, 1 norm. Default 0.
  GESTUS_PARAMETER_RIDGE = 2,
  // Width δ of the mixing kernel (Xia 2015, eq. 4). Wider mixes more classes, costs more and blurs the action; Xia
  // 2015 has 0.7. 0.001 to 1000. Default 0.2.
  GESTUS_PARAMETER_DELTA = 3,
  // Weight of the classes that may be dropped from a frame's mixture. More is faster, and joints may jump where a
  // class comes or goes. 0 to 0.99999994. Default 0.01.
  GESTUS_PARAMETER_PRUNE = 4,
  // Most classes in a frame's mixture. It bounds the slowest frame; a frame that reaches it reports `CLASSES`. 1 to
  // 8. Default 8.
  GESTUS_PARAMETER_CLASSES = 5,
  // Half width κ of the interval about the neighbors' mean inside which the input is trusted, in standard deviations
  // of the neighbors (Xia 2015, eq. 6). Wider passes less of an unusual gesture on to the output. 0 to 1000000.
  // Default 0.25.
  GESTUS_PARAMETER_KAPPA = 6,
  // Part ρ of what lies outside that interval that is kept in the output (Xia 2015, eq. 7). More keeps more of the
  // input's own character, and is further from the style. 0 to 1. Default 0.5.
  GESTUS_PARAMETER_RHO = 7,
  // Most distances computed in a class and frame: what bounds the slowest frame. Fewer lose neighbors where the
  // stream jumps; a frame that reaches the cap reports `VISITS`. 64 to 448. Default 256.
  GESTUS_PARAMETER_VISITS = 8,
  // Frames that the search keeps as candidates; at least `k` are kept. More find more of the true neighbors and
  // visit more. 1 to 64. Default 40.
  GESTUS_PARAMETER_POOL = 9,
  // A class is searched anew where its mean squared distance is this many times the last frame's. Lower notices a
  // jump sooner, and searches anew without need. 1 to 1000000000. Default 4.
  GESTUS_PARAMETER_JUMP = 10,
  // Policy for the output's time. `free` is for files; a robot that takes a pose each tick wants `sync`. 0 free, 1
  // sync. Default 0.
  GESTUS_PARAMETER_TIMING = 11,
  // Width of the kernel that predicts the time step, in mean squared distances of the neighbors (Xia 2015, section
  // 5.1). Wider averages more: time steps vary less. 0.001 to 1000. Default 0.5.
  GESTUS_PARAMETER_TIMING_WIDTH = 12,
  // Where the output's heading comes from. A predicted heading drifts from the input's in turns. 0 input, 1
  // predicted. Default 0.
  GESTUS_PARAMETER_YAW = 13,
  // How far kc a linear model is trusted, in standard deviations of its inputs (Hsu 2005, eq. 8). Of some sixty dofs
  // one is always two or three deviations out: less makes the model come and go, which is seen. 0.001 to 1000000.
  // Default 5.
  GESTUS_PARAMETER_CONFIDENCE = 14,
  // How sharply kp a linear model gives way to the input beyond that (Hsu 2005, eq. 8). Sharper switches, softer
  // mixes the input in everywhere. 0.001 to 1000. Default 8.
  GESTUS_PARAMETER_PREFERENCE = 15,
  // Half-life of the input's running statistics in statistical transfer, seconds; 0 takes those of the database.
  // Short ones follow a performer that differs from the database, and forget slow motion. 0 to 1000000. Default 0.
  GESTUS_PARAMETER_HALFLIFE = 16,
  // The method of translation. The database has to hold what it needs; a running stream begins anew with it. 0 mar,
  // 1 lti, 2 statistic. Default 0.
  GESTUS_PARAMETER_METHOD = 17,
  // Whether feet that stand are held where they stand. Without it feet slide by some 10 cm/s. 0 no, 1 yes. Default
  // 1.
  GESTUS_PARAMETER_CONTACTS = 18,
  // The output where the input is late, out of order, no pose, or leaps. A robot wants `hold` or `rest`. 0 follow, 1
  // hold, 2 rest. Default 0.
  GESTUS_PARAMETER_SAFETY = 19,
  // A held foot takes a step where it lies further than this from where the prediction has it, metres. Less steps
  // more often, more stretches legs. 0.01 to 1. Default 0.2.
  GESTUS_PARAMETER_RELEASE = 20,
  // Shortest time in which a foot that leaves the floor returns to where the prediction has it, seconds. Less is
  // seen as a jerk, more drags feet. 0.01 to 2. Default 0.2.
  GESTUS_PARAMETER_EASE = 21,
  // How many times λ the coefficient of the last output is penalised with; 1 in Xia 2015. More forgets an error
  // sooner at a small λ, and makes the output rougher. 0.001 to 1000000. Default 1.
  GESTUS_PARAMETER_FEEDBACK = 22,
  // How fast a joint of the output may turn, in multiples of the input's fastest joint of the last seconds; 0 sets
  // no limit. Lower holds quick gestures of the style back. 1 to 100, or 0 for none. Default 1.2.
  GESTUS_PARAMETER_SPEED_LIMIT = 23,
  // Half width κy of the interval about the neighbors' mean that an output stays in, in standard deviations of the
  // dof over the database; Xia 2015 has none. Wider lets outputs that feed each other run away from every example. 0
  // to 1000000. Default 2.
  GESTUS_PARAMETER_OUTPUT_KAPPA = 24,
} GestusParameter;

// A checked blob. It lies in memory that the caller gave, and refers to the blob, which has to stay as long.
typedef struct GestusDatabase GestusDatabase;

// Turns a stream of poses into another style. It lies in memory that the caller gave, and refers to the blob, which
// has to stay as long. One stream needs one stylizer; several may share a database. A stylizer may be used by one
// thread, or by one thread and the interrupts that it holds off, at a time.
typedef struct GestusStylizer GestusStylizer;

// What a stylizer can be told when it is made. Fill it by `gestus_config_default`, then change what is to be
// different.
typedef struct GestusConfig {
  // Neighbors a class, 1 to what the profile takes. Default 16.
  uint32_t neighbors;
  // Most distances computed in a class a frame, 64 to 448: what bounds the time of a step. Default 256.
  uint32_t visits;
  // Most classes of a frame, 1 to 8. Default 8.
  uint32_t classes;
  // Policy for the output's time, a number of `GestusTiming`. Default `GESTUS_TIMING_FREE`.
  uint32_t timing;
  // The method of translation, a number of `GestusMethod`. Default `GESTUS_METHOD_MIXTURE`, which a database that was cut
  // to its models does not hold.
  uint32_t method;
} GestusConfig;

// Where a blob was found to be wrong. Fields that an error does not have are 0.
typedef struct GestusBlobDetail {
  // Bytes, or the format version, that is needed.
  uint32_t need;
  // Bytes, or the format version, that is there.
  uint32_t have;
  // Number of the section, as in docs/FORMAT.md; 0 is the header.
  uint32_t section;
  // Record of the section.
  uint32_t record;
} GestusBlobDetail;

// The counts of a database.
typedef struct GestusCounts {
  // Joints of the skeleton; joint 0 is the root.
  uint32_t joints;
  // Styles.
  uint32_t styles;
  // Actions.
  uint32_t actions;
  // Classes: combinations of action and style that hold frames.
  uint32_t classes;
  // Joint groups.
  uint32_t groups;
  // Captured frames.
  uint32_t frames;
  // Poses a second that a stylizer expects.
  float rate_hz;
} GestusCounts;

// A joint of the database's skeleton.
typedef struct GestusJoint {
  // Number of the parent, which is smaller than the joint's own; -1 for the root.
  int32_t parent;
  // Joint group.
  uint32_t group;
  // Position in the parent's frame, metres.
  float offset[3];
} GestusJoint;

// A class of a database: the frames of one action in one style.
typedef struct GestusClass {
  // Number of the action.
  uint32_t action;
  // Number of the style.
  uint32_t style;
  // Frames.
  uint32_t frames;
} GestusClass;

// A class of a frame and its proportion.
typedef struct GestusShare {
  // Number of the class.
  uint32_t class_index;
  // Its proportion; those of a frame sum to 1.
  float proportion;
} GestusShare;

// What happened in a step.
typedef struct GestusReport {
  // Time from the last output pose to this one, seconds, under the timing policy.
  float step_s;
  // The same as predicted, whatever the policy and the strength of the style.
  float predicted_step_s;
  // Mean squared distance of the nearest class's neighbors, weighted square metres: how far from the data.
  float distance2;
  // Distances computed.
  uint32_t visits;
  // Bytes of the blob that were read.
  uint32_t bytes_read;
  // Each way in which the frame was degraded: bits `GESTUS_DEGRADED_...`; 0 where it was not.
  uint32_t degraded;
  // 1 where the left foot stands, 0 where it does not.
  uint32_t left_contact;
  // The same of the right foot.
  uint32_t right_contact;
  // How many of `classes` are in use.
  uint32_t class_count;
  // The classes used, largest proportion first.
  struct GestusShare classes[GESTUS_MOST_CLASSES];
} GestusReport;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Fills a configuration with the defaults of a profile.
//
// Answers `GESTUS_STATUS_PROFILE`, `_NULL`, `_MISALIGNED`.
//
// # Safety
// `config` points at memory for a `GestusConfig`.
enum GestusStatus gestus_config_default(uint32_t profile, struct GestusConfig *config);

// The version of this library, as text that ends with a zero and stays for ever: "0.1.0".
const char *gestus_version(void);

// The version of the blob format that this library reads.
uint32_t gestus_blob_version(void);

// Bytes that `gestus_database_open` needs.
size_t gestus_database_size(void);

// Alignment, in bytes, of the memory that `gestus_database_open` needs: 8.
size_t gestus_database_alignment(void);

// Checks a blob and makes a database of it in `memory`. The handle is put into `*database`; it is `memory` itself.
//
// Every byte is checked, once: lengths, checksums, every index. It takes time in proportion to the blob's length.
// The blob is read in place from then on. It may be of any alignment, and has to stay as it is for as long as the
// database, or a stylizer that was made of it, is used.
//
// `detail` may be null; otherwise it says, where the blob is refused, which section and record is wrong.
//
// Answers a status `GESTUS_STATUS_BLOB_...`, or `_NULL`, `_MISALIGNED`, `_SHORT` (`bytes` is less than
// `gestus_database_size()`, or a length is beyond the address space), `_OVERLAP`.
//
// # Safety
// `memory` points at `bytes` bytes, `blob` at `blob_bytes` bytes.
enum GestusStatus gestus_database_open(void *memory,
                                       size_t bytes,
                                       const uint8_t *blob,
                                       size_t blob_bytes,
                                       struct GestusBlobDetail *detail,
                                       struct GestusDatabase **database);

// Makes a database's handle stale, so that using it later is noticed. Need not be called; the memory is the
// caller's again in any case. Stylizers that were made of it go on: they refer to the blob alone.
//
// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `database` came from `gestus_database_open`.
enum GestusStatus gestus_database_close(struct GestusDatabase *database);

// Puts the counts of a database into `*counts`.
//
// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
//
// # Safety
// `database` came from `gestus_database_open`; `counts` points at memory for a `GestusCounts`.
enum GestusStatus gestus_database_counts(const struct GestusDatabase *database, struct GestusCounts *counts);

// Copies the name of a joint, style, action or group into `text`, with a zero behind it.
//
// `length` may be null; otherwise the name's length without the zero is put there, also where `text` is too short,
// so that the call can be made again with more room. `text` may be null where `bytes` is 0.
//
// Answers `GESTUS_STATUS_NOT_FOUND` (no such kind or index), `_SHORT` (`bytes` is not enough: nothing is copied),
// `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
//
// # Safety
// `database` came from `gestus_database_open`; `text` points at `bytes` bytes; `length` is null or points at memory
// for a `size_t`.
enum GestusStatus gestus_database_name(const struct GestusDatabase *database,
                                       uint32_t kind,
                                       uint32_t index,
                                       char *text,
                                       size_t bytes,
                                       size_t *length);

// Puts the number of the joint, style, action or group of that name into `*index`.
//
// Answers `GESTUS_STATUS_NOT_FOUND`, `_TEXT` (longer than `GESTUS_NAME_BYTES`, or not UTF-8), `_NULL`,
// `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
//
// # Safety
// `database` came from `gestus_database_open`; `name` points at a text that ends with a zero; `index` points at
// memory for a `uint32_t`.
enum GestusStatus gestus_database_find(const struct GestusDatabase *database,
                                       uint32_t kind,
                                       const char *name,
                                       uint32_t *index);

// Puts joint `index` into `*joint`.
//
// Answers `GESTUS_STATUS_NOT_FOUND`, `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
//
// # Safety
// `database` came from `gestus_database_open`; `joint` points at memory for a `GestusJoint`.
enum GestusStatus gestus_database_joint(const struct GestusDatabase *database,
                                        uint32_t index,
                                        struct GestusJoint *joint);

// Puts class `index` into `*value`.
//
// Answers `GESTUS_STATUS_NOT_FOUND`, `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
//
// # Safety
// `database` came from `gestus_database_open`; `value` points at memory for a `GestusClass`.
enum GestusStatus gestus_database_class(const struct GestusDatabase *database,
                                        uint32_t index,
                                        struct GestusClass *value);

// Takes a pose and its time step into the digest of a stream: `*digest` is 0 before the first pose, and equal on every
// machine where every bit of every pose is.
//
// Answers `GESTUS_STATUS_SHORT` (`joints` is 0, or more than a database may have, 64), `_NULL`, `_MISALIGNED`, `_OVERLAP`.
//
// # Safety
// `digest` points at a `uint32_t`, `position` at 3 numbers, `rotations` at 4 times `joints`.
enum GestusStatus gestus_digest(uint32_t *digest,
                                const float *position,
                                const float *rotations,
                                size_t joints,
                                float step_s);

// Sets the output style: `count` numbers of styles and their weights, which are brought to sum 1. A style may come
// more than once; its weights add up.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such style), `_WEIGHTS` (`count` is 0 or above 32, a weight is negative or not
// finite, or all are 0), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP` (an array with the stylizer).
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`; `styles` and `weights` point at `count` numbers.
enum GestusStatus gestus_stylizer_set_style(struct GestusStylizer *stylizer,
                                            const uint16_t *styles,
                                            const float *weights,
                                            size_t count);

// Sets the output style of a joint group alone, in place of the body's: `count` numbers of styles and their weights,
// which are brought to sum 1; a `count` of 0 gives the group back to the body's style (the arrays are not read then). The
// group of the root says which feet stand and how long a step takes. Each mix that differs costs the regression once more.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such group or style), `_WEIGHTS` (`count` is above 3, a weight is negative or not
// finite, or all are 0), `_METHOD` (linear models know the whole body's style alone), `_NULL`, `_MISALIGNED`, `_HANDLE`,
// `_OVERLAP` (an array with the stylizer).
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`; `styles` and `weights` point at `count` numbers.
enum GestusStatus gestus_stylizer_set_group_style(struct GestusStylizer *stylizer,
                                                  uint32_t group,
                                                  const uint16_t *styles,
                                                  const float *weights,
                                                  size_t count);

// Sets the output style to the one of that name, alone.
//
// Answers `GESTUS_STATUS_NOT_FOUND`, `_TEXT` (longer than `GESTUS_NAME_BYTES`, or not UTF-8), `_NULL`,
// `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`; `name` points at a text that ends with a zero, apart from the stylizer.
enum GestusStatus gestus_stylizer_set_style_name(struct GestusStylizer *stylizer,
                                                 const char *name);

// Sets the output style to the mix that comes nearest to an Effort: how bound (`flow`), strong (`weight`) and sudden
// (`time`) the motion is to be, each from -3 to 3, 0 being what is usual for the data. Beyond that it is held at the end.
//
// Answers `GESTUS_STATUS_NO_DIAL` (the database has no effort dial), `_PARAMETER` (not a number), `_NULL`,
// `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_set_effort(struct GestusStylizer *stylizer,
                                             float flow,
                                             float weight,
                                             float time);

// Says which action the input is, where the caller knows it; a negative number where not. Only classes of that action
// are searched then, which takes less time.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such action), `_NO_CLASS` (not in the labelled input style), `_NULL`,
// `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_set_action(struct GestusStylizer *stylizer,
                                             int32_t action);

// Says which style the input is in, where the caller knows it; a negative number where not.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such style), `_NO_CLASS` (not of the labelled action), `_NULL`, `_MISALIGNED`,
// `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_set_input_style(struct GestusStylizer *stylizer,
                                                  int32_t style);

// Says whether the search looks at a joint group: 0 leaves it out, any other number looks. At least one group is always
// looked at.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such group), `_PARAMETER` (no group would be left), `_NULL`, `_MISALIGNED`,
// `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_set_mask(struct GestusStylizer *stylizer,
                                           uint32_t group,
                                           uint32_t searched);

// Says how much of the style a joint group takes on: 0 leaves the input as it is, 1 is the style, up to 2 goes beyond.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such group), `_PARAMETER` (not from 0 to 2), `_NULL`, `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_set_strength(struct GestusStylizer *stylizer,
                                               uint32_t group,
                                               float strength);

// Sets how many distances are computed at most in a class a frame, 64 to 448: what a step costs in the worst case. The
// first thing to lower where a deadline was missed; frames that reach it report `GESTUS_DEGRADED_VISITS`.
//
// Answers `GESTUS_STATUS_PARAMETER` (not from 64 to 448), `_NULL`, `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_set_visits(struct GestusStylizer *stylizer,
                                             uint32_t visits);

// Sets a parameter of the method, a number of `GestusParameter`, from the next step on. The stream goes on; with another
// method it begins anew, and both labels are taken back: say the action and the input style again.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such parameter), `_PARAMETER` (out of its range, or no whole number where one is
// wanted), `_NEIGHBORS` (more than the profile takes), `_METHOD` (the database does not hold what the method needs, or the
// method is that of linear models, which style the whole body, while a joint group has a style of its own), `_NULL`,
// `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_set_parameter(struct GestusStylizer *stylizer,
                                                uint32_t parameter,
                                                float value);

// Puts the value that a parameter has, a number of `GestusParameter`, into `*value`.
//
// Answers `GESTUS_STATUS_UNKNOWN` (no such parameter), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP` (`value` with the
// stylizer).
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`; `value` points at memory for a number.
enum GestusStatus gestus_stylizer_parameter(struct GestusStylizer *stylizer,
                                            uint32_t parameter,
                                            float *value);

// Forgets the stream; the next pose is a first pose. Settings stay.
//
// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_reset(struct GestusStylizer *stylizer);

// What a status means, in English, as text that ends with a zero and stays for ever. Numbers that are no status
// have a text too; it never answers null.
const char *gestus_error_message(uint32_t status);

// Bytes that `gestus_stylizer_init` needs for a profile; 0 where this library has no such profile.
size_t gestus_stylizer_size(uint32_t profile);

// Alignment, in bytes, of the memory that `gestus_stylizer_init` needs for a profile; 0 where this library has no
// such profile.
size_t gestus_stylizer_alignment(uint32_t profile);

// Makes a stylizer in `memory` that puts out the database's first style until told otherwise. The handle is put into
// `*stylizer`; it is `memory` itself, and the object can't be moved.
//
// While it is made it takes as much stack as memory, once: call it early, from a shallow place. A step takes far less.
//
// `config` may be null: then it is what `gestus_config_default` gives.
//
// Answers `GESTUS_STATUS_PROFILE`, `_JOINTS` or `_CLASSES` (the database has more than the profile takes),
// `_NEIGHBORS`, `_PARAMETER`, `_METHOD` (the database does not hold what the method needs), `_NULL`, `_MISALIGNED`, `_SHORT`
// (`bytes` is less than `gestus_stylizer_size`), `_OVERLAP`, `_HANDLE` (of the database).
//
// # Safety
// `memory` points at `bytes` bytes; `database` came from `gestus_database_open`; `config` is null or points at a
// `GestusConfig`; `stylizer` points at memory for a pointer.
enum GestusStatus gestus_stylizer_init(void *memory,
                                       size_t bytes,
                                       uint32_t profile,
                                       const struct GestusDatabase *database,
                                       const struct GestusConfig *config,
                                       struct GestusStylizer **stylizer);

// Makes a stylizer's handle stale, so that using it later is noticed. Need not be called; the memory is the caller's
// again in any case.
//
// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`.
enum GestusStatus gestus_stylizer_close(struct GestusStylizer *stylizer);

// Takes one pose at the database's rate, gives it the style, and says what happened.
//
// A pose is the root's position, 3 numbers in metres, Y up, and `joints` unit quaternions x, y, z, w one behind the
// other: joint 0 is the root's orientation in the world, the others are local to their parents. `joints` is at least
// the database's number of joints; the numbers of joints beyond are neither read nor written.
//
// The output may be put where the input was: `position` may be `out_position` and `rotations` may be
// `out_rotations`, whole or overlapping in any way. Otherwise nothing that is written may overlap anything.
// `report` may be null.
//
// With good arguments a step can't fail: input that is no pose is answered with the last output, and reported in
// `degraded`. Before there was an output the answer is a pose without any rotation, which is nothing to play.
//
// Answers `GESTUS_STATUS_SHORT` (`joints` is less than the database's), `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
// Then the stylizer has not stepped.
//
// # Safety
// `stylizer` came from `gestus_stylizer_init`; `position` and `out_position` point at 3 numbers, `rotations` and
// `out_rotations` at 4 times `joints`; `report` is null or points at memory for a `GestusReport`.
enum GestusStatus gestus_stylizer_step(struct GestusStylizer *stylizer,
                                       const float *position,
                                       const float *rotations,
                                       size_t joints,
                                       float *out_position,
                                       float *out_rotations,
                                       struct GestusReport *report);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* GESTUS_H */
