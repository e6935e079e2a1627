/* USB cameras (UVC) as Linux serves them to programs, without a camera and without the kernel.
 *
 * Loaded by LD_PRELOAD, this library answers the system calls on /dev/videoN as the kernel's
 * uvcvideo driver does; every other file goes on to the kernel. References such as [QBUF] are
 * sections of "Video for Linux API", part I of the Linux Media Infrastructure userspace API. What
 * the API leaves to the driver follows uvcvideo:
 *   - a format or size that there is not becomes the first format, the nearest size; a rate the
 *     nearest rate; a control is clamped to its range;
 *   - a frame goes to a buffer that was queued when its transfer began; without one it is lost
 *     whole, and `sequence` counts it; its stamp is the beginning of its transfer, by
 *     CLOCK_MONOTONIC;
 *   - after the plug is pulled everything fails with ENODEV.
 *
 * Camera N is plugged in while there is a folder $EMULATED_V4L2/videoN. In it are
 *   camera      lines "mode FOURCC WIDTH HEIGHT 1/30 1/15 ..." and
 *               "control ID MINIMUM MAXIMUM STEP INITIAL", the ID in hexadecimal
 *               (linux/v4l2-controls.h); the first mode and rate are its own
 *   YUYV-640x480 and so on: what it sees, as the bytes of one frame of that mode
 *   phase_ns    (may be missing) when it takes pictures: at phase + k periods
 *   stalled     while there is this file, no frame comes
 *   log         what it was told, one line each, written by this library
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <time.h>
#include <unistd.h>

enum { CAMERAS = 4, MODES = 16, RATES = 8, CONTROLS = 16, BUFFERS = 32, HANDLES = 16 };
enum { SECOND = 1000000000 }; /* in nanoseconds */

struct mode {
  uint32_t format, width, height, n_rates;
  struct v4l2_fract periods[RATES];
};

struct control {
  uint32_t id;
  int32_t minimum, maximum, step, initial, value;
};

struct buffer {
  enum { WITH_PROGRAM, QUEUED, FILLED } state;
  uint64_t turn;                             /* buffers are filled, and given out, in turn */
  int64_t queued_ns, stamp_ns, complete_ns;  /* complete: all of it has come over the wire */
  uint32_t sequence, used;
};

struct camera {
  char folder[512];
  bool known; /* its description was read since it was plugged in */
  uint32_t n_modes, n_controls, n_buffers;
  struct mode modes[MODES], *mode;
  struct v4l2_fract period;
  struct control controls[CONTROLS];
  int owner; /* handle whose buffers these are; nobody else can set or stream meanwhile */
  struct buffer buffers[BUFFERS];
  uint8_t *memory;
  bool streaming;
  int64_t next_ns; /* beginning of the next frame */
  uint32_t sequence;
  uint64_t turn;
};

struct handle {
  int fd; /* a memory file, so that the kernel itself maps the buffers [mmap()] */
  struct camera *camera;
  bool unplugged;
};

static struct camera cameras[CAMERAS];
static struct handle handles[HANDLES];
static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;

static int64_t now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * SECOND + now.tv_nsec;
}

static bool readable(const struct camera *camera, const char *name, char *path, size_t size) {
  snprintf(path, size, "%s/%s", camera->folder, name);
  return access(path, R_OK) == 0;
}

static void note(const struct camera *camera, const char *format, ...) {
  char path[600];
  snprintf(path, sizeof path, "%s/log", camera->folder);
  FILE *file = fopen(path, "a");
  if (!file) return;
  va_list values;
  va_start(values, format);
  vfprintf(file, format, values);
  va_end(values);
  fputc('\n', file);
  fclose(file);
}

static const char *fourcc(uint32_t format, char text[5]) {
  for (int i = 0; i < 4; i++) text[i] = (char)(format >> 8 * i);
  text[4] = '\0';
  return text;
}

/* ---- What the camera is ---- */

static void read_mode(struct camera *camera, char *words) {
  struct mode *mode = &camera->modes[camera->n_modes];
  char format[5];
  int at = 0, more = 0;
  if (camera->n_modes == MODES ||
      sscanf(words, "%4s %u %u%n", format, &mode->width, &mode->height, &at) < 3)
    return;
  mode->format = v4l2_fourcc(format[0], format[1], format[2], format[3]);
  for (mode->n_rates = 0; mode->n_rates < RATES; mode->n_rates++, at += more) {
    struct v4l2_fract *period = &mode->periods[mode->n_rates];
    if (sscanf(words + at, " %u/%u%n", &period->numerator, &period->denominator, &more) < 2) break;
  }
  camera->n_modes++;
}

static void read_control(struct camera *camera, const char *words) {
  struct control *control = &camera->controls[camera->n_controls];
  if (camera->n_controls < CONTROLS &&
      sscanf(words, "%x %d %d %d %d", &control->id, &control->minimum, &control->maximum,
             &control->step, &control->initial) == 5) {
    control->value = control->initial;
    camera->n_controls++;
  }
}

/* Reads what a camera is that was just plugged in; it remembers nothing of the time before. */
static bool describe(struct camera *camera) {
  char path[600], line[256];
  if (!readable(camera, "camera", path, sizeof path)) return false;
  if (camera->known) return true;
  FILE *file = fopen(path, "r");
  if (!file) return false;
  camera->n_modes = camera->n_controls = camera->n_buffers = 0;
  camera->owner = -1;
  camera->streaming = false;
  while (fgets(line, sizeof line, file)) {
    if (strncmp(line, "mode ", 5) == 0) read_mode(camera, line + 5);
    if (strncmp(line, "control ", 8) == 0) read_control(camera, line + 8);
  }
  fclose(file);
  camera->mode = &camera->modes[0];
  camera->period = camera->mode->periods[0];
  return camera->known = camera->n_modes > 0;
}

static struct control *find_control(struct camera *camera, uint32_t id) {
  for (uint32_t i = 0; i < camera->n_controls; i++)
    if (camera->controls[i].id == id) return &camera->controls[i];
  return NULL;
}

/* ---- Frames ---- */

static uint32_t frame_size(const struct mode *mode) {
  bool one_byte = mode->format == V4L2_PIX_FMT_GREY;
  return mode->width * mode->height * (one_byte ? 1 : 2); /* MJPG: the largest that may come */
}

static uint32_t buffer_step(const struct mode *mode) { /* mmap wants whole pages */
  uint32_t page = (uint32_t)sysconf(_SC_PAGESIZE);
  return (frame_size(mode) + page - 1) / page * page;
}

static int64_t period_ns(const struct camera *camera) {
  return (int64_t)SECOND * camera->period.numerator / camera->period.denominator;
}

/* Of the buffers in a state since a moment, the one whose turn it is. */
static struct buffer *first(struct camera *camera, int state, int64_t since_ns) {
  struct buffer *found = NULL;
  for (uint32_t i = 0; i < camera->n_buffers; i++) {
    struct buffer *buffer = &camera->buffers[i];
    int64_t at_ns = state == QUEUED ? buffer->queued_ns : buffer->complete_ns;
    if ((int)buffer->state == state && at_ns <= since_ns && (!found || buffer->turn < found->turn))
      found = buffer;
  }
  return found;
}

static void take_picture(struct camera *camera, struct buffer *buffer) {
  char name[64], path[600], text[5];
  const struct mode *mode = camera->mode;
  snprintf(name, sizeof name, "%s-%ux%u", fourcc(mode->format, text), mode->width, mode->height);
  FILE *file = readable(camera, name, path, sizeof path) ? fopen(path, "rb") : NULL;
  if (!file) return; /* no picture: the frame is lost */
  uint8_t *memory = camera->memory + (size_t)(buffer - camera->buffers) * buffer_step(mode);
  buffer->used = (uint32_t)fread(memory, 1, frame_size(mode), file);
  fclose(file);
  buffer->state = FILLED;
  buffer->stamp_ns = camera->next_ns;
  buffer->complete_ns = camera->next_ns + period_ns(camera) * 9 / 10;
  buffer->sequence = camera->sequence;
}

/* Makes happen what has happened by now. */
static void advance(struct camera *camera) {
  char path[600];
  int64_t now = now_ns();
  if (!camera->streaming || camera->next_ns > now) return;
  bool stalled = readable(camera, "stalled", path, sizeof path);
  for (; camera->next_ns <= now; camera->next_ns += period_ns(camera)) {
    struct buffer *buffer = first(camera, QUEUED, camera->next_ns);
    if (buffer && !stalled) take_picture(camera, buffer);
    camera->sequence++;
  }
}

static void start(struct camera *camera) {
  char path[600];
  long long phase = 0;
  FILE *file = readable(camera, "phase_ns", path, sizeof path) ? fopen(path, "r") : NULL;
  if (file && fscanf(file, "%lld", &phase) != 1) phase = 0;
  if (file) fclose(file);
  int64_t period = period_ns(camera);
  camera->next_ns = (now_ns() - phase) / period * period + period + phase;
  camera->sequence = 0;
  camera->streaming = true;
}

static void free_buffers(struct camera *camera) {
  if (camera->n_buffers)
    munmap(camera->memory, (size_t)camera->n_buffers * buffer_step(camera->mode));
  camera->n_buffers = 0;
  camera->owner = -1;
  camera->streaming = false;
}

static bool unplugged(struct handle *handle) {
  char path[600];
  if (!handle->unplugged && !readable(handle->camera, "camera", path, sizeof path)) {
    handle->unplugged = true;
    handle->camera->known = false;
  }
  return handle->unplugged;
}

/* ---- The calls; each returns 0 or the error ---- */

static int querycap(struct v4l2_capability *found) { /* [QUERYCAP] */
  memset(found, 0, sizeof *found);
  strcpy((char *)found->driver, "uvcvideo");
  strcpy((char *)found->card, "Emulated camera");
  strcpy((char *)found->bus_info, "usb-emulated-1");
  found->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  found->capabilities = found->device_caps | V4L2_CAP_DEVICE_CAPS;
  return 0;
}

static int g_fmt(const struct camera *camera, struct v4l2_format *format) { /* [G_FMT] */
  struct v4l2_pix_format *pix = &format->fmt.pix;
  const struct mode *mode = camera->mode;
  memset(pix, 0, sizeof *pix);
  pix->pixelformat = mode->format;
  pix->width = mode->width;
  pix->height = mode->height;
  pix->field = V4L2_FIELD_NONE;
  pix->sizeimage = frame_size(mode);
  pix->bytesperline = mode->format == V4L2_PIX_FMT_MJPEG ? 0 : pix->sizeimage / mode->height;
  pix->colorspace = V4L2_COLORSPACE_SRGB;
  return 0;
}

/* By how many pixels two sizes differ, one laid upon the other. */
static uint64_t difference(const struct mode *mode, const struct v4l2_pix_format *pix) {
  uint64_t width = mode->width < pix->width ? mode->width : pix->width;
  uint64_t height = mode->height < pix->height ? mode->height : pix->height;
  return (uint64_t)mode->width * mode->height + (uint64_t)pix->width * pix->height -
         2 * width * height;
}

static int s_fmt(struct camera *camera, struct v4l2_format *format) { /* [S_FMT] */
  const struct v4l2_pix_format asked = format->fmt.pix;
  uint32_t wanted = camera->modes[0].format;
  char texts[2][5];
  if (camera->n_buffers) return EBUSY;
  for (uint32_t i = 0; i < camera->n_modes; i++)
    if (camera->modes[i].format == asked.pixelformat) wanted = asked.pixelformat;
  camera->mode = NULL;
  for (uint32_t i = 0; i < camera->n_modes; i++) {
    struct mode *mode = &camera->modes[i];
    if (mode->format != wanted) continue;
    if (!camera->mode || difference(mode, &asked) < difference(camera->mode, &asked))
      camera->mode = mode;
  }
  camera->period = camera->mode->periods[0];
  note(camera, "S_FMT %s %ux%u gives %s %ux%u", fourcc(asked.pixelformat, texts[0]), asked.width,
       asked.height, fourcc(wanted, texts[1]), camera->mode->width, camera->mode->height);
  return g_fmt(camera, format);
}

static int g_parm(const struct camera *camera, struct v4l2_streamparm *parm) { /* [G_PARM] */
  memset(&parm->parm, 0, sizeof parm->parm);
  parm->parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
  parm->parm.capture.timeperframe = camera->period;
  return 0;
}

static int s_parm(struct camera *camera, struct v4l2_streamparm *parm) { /* [S_PARM] */
  const struct v4l2_fract asked = parm->parm.capture.timeperframe;
  double nearest = 1e9;
  if (camera->streaming) return EBUSY;
  if (!asked.numerator || !asked.denominator) return EINVAL;
  for (uint32_t i = 0; i < camera->mode->n_rates; i++) {
    const struct v4l2_fract period = camera->mode->periods[i];
    double apart = (double)period.numerator / period.denominator -
                   (double)asked.numerator / asked.denominator;
    if ((apart < 0 ? -apart : apart) >= nearest) continue;
    nearest = apart < 0 ? -apart : apart;
    camera->period = period;
  }
  note(camera, "S_PARM %u/%u gives %u/%u", asked.numerator, asked.denominator,
       camera->period.numerator, camera->period.denominator);
  return g_parm(camera, parm);
}

static int queryctrl(struct camera *camera, struct v4l2_queryctrl *query) { /* [QUERYCTRL] */
  const struct control *control = find_control(camera, query->id);
  if (!control) return EINVAL;
  memset(query, 0, sizeof *query);
  query->id = control->id;
  bool menu = control->id == V4L2_CID_EXPOSURE_AUTO;
  query->type = menu ? V4L2_CTRL_TYPE_MENU : V4L2_CTRL_TYPE_INTEGER;
  query->minimum = control->minimum;
  query->maximum = control->maximum;
  query->step = control->step;
  query->default_value = control->initial;
  return 0;
}

static int s_ctrl(struct camera *camera, struct v4l2_control *asked) { /* [G_CTRL] */
  struct control *control = find_control(camera, asked->id);
  const struct control *automatic = find_control(camera, V4L2_CID_EXPOSURE_AUTO);
  int32_t wanted = asked->value;
  if (!control) return EINVAL;
  /* A UVC camera stalls the request for an exposure while that is automatic. */
  if (asked->id == V4L2_CID_EXPOSURE_ABSOLUTE && automatic &&
      automatic->value != V4L2_EXPOSURE_MANUAL)
    return EACCES;
  if (asked->value < control->minimum) asked->value = control->minimum;
  if (asked->value > control->maximum) asked->value = control->maximum;
  asked->value -= (asked->value - control->minimum) % control->step;
  control->value = asked->value;
  note(camera, "S_CTRL %08x %d gives %d", asked->id, wanted, asked->value);
  return 0;
}

static int g_ctrl(struct camera *camera, struct v4l2_control *asked) { /* [G_CTRL] */
  const struct control *control = find_control(camera, asked->id);
  if (!control) return EINVAL;
  asked->value = control->value;
  return 0;
}

static int reqbufs(struct handle *handle, struct v4l2_requestbuffers *asked) { /* [REQBUFS] */
  struct camera *camera = handle->camera;
  if (camera->n_buffers && camera->owner != handle->fd) return EBUSY;
  if (asked->memory != V4L2_MEMORY_MMAP) return EINVAL;
  free_buffers(camera);
  note(camera, "REQBUFS %u", asked->count);
  if (asked->count > BUFFERS) asked->count = BUFFERS;
  if (!asked->count) return 0;
  size_t size = (size_t)asked->count * buffer_step(camera->mode);
  if (ftruncate(handle->fd, (off_t)size)) return ENOMEM;
  void *memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, handle->fd, 0);
  if (memory == MAP_FAILED) return ENOMEM;
  camera->memory = memory;
  camera->n_buffers = asked->count;
  camera->owner = handle->fd;
  memset(camera->buffers, 0, sizeof camera->buffers);
  return 0;
}

static void tell(const struct camera *camera, const struct buffer *buffer,
                 struct v4l2_buffer *told) {
  told->index = (uint32_t)(buffer - camera->buffers);
  told->memory = V4L2_MEMORY_MMAP;
  told->length = frame_size(camera->mode);
  told->m.offset = told->index * buffer_step(camera->mode);
  told->bytesused = buffer->used;
  told->sequence = buffer->sequence;
  told->field = V4L2_FIELD_NONE;
  told->flags = V4L2_BUF_FLAG_MAPPED | V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC |
                V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  told->timestamp.tv_sec = buffer->stamp_ns / SECOND;
  told->timestamp.tv_usec = buffer->stamp_ns % SECOND / 1000;
}

static int querybuf(const struct camera *camera, struct v4l2_buffer *asked) { /* [QUERYBUF] */
  if (asked->index >= camera->n_buffers) return EINVAL;
  tell(camera, &camera->buffers[asked->index], asked);
  return 0;
}

static int qbuf(struct camera *camera, struct v4l2_buffer *given) { /* [QBUF] */
  if (given->index >= camera->n_buffers) return EINVAL;
  struct buffer *buffer = &camera->buffers[given->index];
  if (buffer->state != WITH_PROGRAM) return EINVAL;
  *buffer = (struct buffer){.state = QUEUED, .queued_ns = now_ns(), .turn = camera->turn++};
  tell(camera, buffer, given);
  return 0;
}

static int dqbuf(struct camera *camera, struct v4l2_buffer *given) { /* [QBUF], O_NONBLOCK */
  if (!camera->streaming) return EINVAL;
  struct buffer *buffer = first(camera, FILLED, now_ns());
  if (!buffer) return EAGAIN;
  buffer->state = WITH_PROGRAM;
  tell(camera, buffer, given);
  return 0;
}

static int streamon(struct camera *camera) { /* [STREAMON] */
  if (!camera->n_buffers) return EINVAL;
  note(camera, "STREAMON");
  if (!camera->streaming) start(camera);
  return 0;
}

static int streamoff(struct camera *camera) { /* [STREAMON]: the buffers go back to the program */
  note(camera, "STREAMOFF");
  camera->streaming = false;
  memset(camera->buffers, 0, sizeof camera->buffers);
  return 0;
}

static int answer(struct handle *handle, uint32_t request, void *value) {
  struct camera *camera = handle->camera;
  if (unplugged(handle)) return ENODEV;
  advance(camera);
  switch (request) {
    case VIDIOC_QUERYCAP: return querycap(value);
    case VIDIOC_QUERYCTRL: return queryctrl(camera, value);
    case VIDIOC_G_CTRL: return g_ctrl(camera, value);
    case VIDIOC_S_CTRL: return s_ctrl(camera, value);
    case VIDIOC_REQBUFS: return reqbufs(handle, value);
    case VIDIOC_STREAMON: return camera->owner == handle->fd ? streamon(camera) : EBUSY;
    case VIDIOC_STREAMOFF: return camera->owner == handle->fd ? streamoff(camera) : EBUSY;
    case VIDIOC_G_FMT: return g_fmt(camera, value);
    case VIDIOC_S_FMT: return s_fmt(camera, value);
    case VIDIOC_G_PARM: return g_parm(camera, value);
    case VIDIOC_S_PARM: return s_parm(camera, value);
    case VIDIOC_QUERYBUF: return querybuf(camera, value);
    case VIDIOC_QBUF: return camera->owner == handle->fd ? qbuf(camera, value) : EBUSY;
    case VIDIOC_DQBUF: return camera->owner == handle->fd ? dqbuf(camera, value) : EBUSY;
  }
  note(camera, "unknown request %08x", request);
  return ENOTTY;
}

/* ---- The functions of the C library that stand before the kernel ---- */

static struct handle *find_handle(int fd) {
  for (int i = 0; i < HANDLES; i++)
    if (handles[i].camera && handles[i].fd == fd) return &handles[i];
  return NULL;
}

static int open_camera(int number) {
  struct handle *free_one = NULL;
  for (int i = 0; i < HANDLES && !free_one; i++)
    if (!handles[i].camera) free_one = &handles[i];
  struct camera *camera = &cameras[number];
  char folder[sizeof camera->folder];
  snprintf(folder, sizeof folder, "%s/video%d", getenv("EMULATED_V4L2"), number);
  if (strcmp(folder, camera->folder) != 0) camera->known = false; /* another one at this number */
  strcpy(camera->folder, folder);
  if (!free_one || !describe(camera)) {
    errno = free_one ? ENOENT : EMFILE;
    return -1;
  }
  int fd = memfd_create("emulated camera", MFD_CLOEXEC);
  if (fd >= 0) *free_one = (struct handle){.fd = fd, .camera = camera};
  return fd;
}

/* The number of an emulated camera; -1 of any other path. */
static int camera_number(const char *path) {
  int number, end = 0;
  if (!path || !getenv("EMULATED_V4L2")) return -1;
  if (sscanf(path, "/dev/video%d%n", &number, &end) != 1 || path[end]) return -1;
  return number < CAMERAS ? number : -1;
}

static int open_any(const char *symbol, const char *path, int flags, mode_t mode) {
  int number = camera_number(path);
  if (number < 0) {
    int (*next)(const char *, int, ...) = (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, symbol);
    return next(path, flags, mode);
  }
  pthread_mutex_lock(&lock);
  int fd = open_camera(number);
  pthread_mutex_unlock(&lock);
  return fd;
}

static mode_t mode_of(int flags, va_list rest) { /* given only where a file may be made */
  return flags & (O_CREAT | __O_TMPFILE) ? va_arg(rest, mode_t) : 0;
}

int open(const char *path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  mode_t mode = mode_of(flags, rest);
  va_end(rest);
  return open_any("open", path, flags, mode);
}

int open64(const char *path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  mode_t mode = mode_of(flags, rest);
  va_end(rest);
  return open_any("open64", path, flags, mode);
}

int close(int fd) {
  int (*next)(int) = (int (*)(int))dlsym(RTLD_NEXT, "close");
  pthread_mutex_lock(&lock);
  struct handle *handle = find_handle(fd);
  if (handle) {
    if (handle->camera->owner == fd) free_buffers(handle->camera);
    handle->camera = NULL;
  }
  pthread_mutex_unlock(&lock);
  return next(fd);
}

int ioctl(int fd, unsigned long request, ...) {
  int (*next)(int, unsigned long, ...) =
      (int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl");
  va_list rest;
  va_start(rest, request);
  void *value = va_arg(rest, void *);
  va_end(rest);
  pthread_mutex_lock(&lock);
  struct handle *handle = find_handle(fd);
  int error = handle ? answer(handle, (uint32_t)request, value) : 0;
  pthread_mutex_unlock(&lock);
  if (!handle) return next(fd, request, value);
  errno = error;
  return error ? -1 : 0;
}

/* [select()] A camera is readable when a frame is there, and when it is gone. */
int select(int n, fd_set *in, fd_set *out, fd_set *other, struct timeval *timeout) {
  int (*next)(int, fd_set *, fd_set *, fd_set *, struct timeval *) =
      (int (*)(int, fd_set *, fd_set *, fd_set *, struct timeval *))dlsym(RTLD_NEXT, "select");
  int64_t until_ns = INT64_MAX;
  if (timeout) until_ns = now_ns() + timeout->tv_sec * (int64_t)SECOND + timeout->tv_usec * 1000;
  for (int fd = 0; in && fd < n; fd++) {
    if (!FD_ISSET(fd, in)) continue;
    for (;;) {
      pthread_mutex_lock(&lock);
      struct handle *handle = find_handle(fd);
      if (handle && !unplugged(handle)) advance(handle->camera);
      bool ready = handle && (handle->unplugged || first(handle->camera, FILLED, now_ns()));
      pthread_mutex_unlock(&lock);
      if (!handle) break;
      bool late = now_ns() >= until_ns;
      if (ready || late) {
        FD_ZERO(in);
        if (ready) FD_SET(fd, in);
        return ready ? 1 : 0;
      }
      nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
  }
  return next(n, in, out, other, timeout);
}
