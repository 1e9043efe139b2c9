/*
 * framing.h - results as an execution asks for them: plain, or as OGC API - Processes 1.0 frames
 * them (its members response and outputs).
 */
#ifndef SRNFD_API_FRAMING_H
#define SRNFD_API_FRAMING_H

#include "api/handler.h"
#include "store/framing.h"

#define FRAMING_OUTPUTS_MAX 32
#define FRAMING_NAME_MAX 48

enum framing_response {
    FRAMING_PLAIN,    /* the outputs as members, as they are */
    FRAMING_DOCUMENT, /* the standard's results.yaml: objects are wrapped, nothing is null */
    FRAMING_RAW,      /* the one output by itself; several as parts */
};

struct framing {
    enum framing_response response;
    size_t n; /* outputs that were asked for; 0: all */
    struct {
        char name[FRAMING_NAME_MAX];
        bool reference; /* a link to it in its place */
    } outputs[FRAMING_OUTPUTS_MAX];
};

/* Whether the results are given as they are stored. */
bool framing_is_plain(const struct framing *framing);
/* The members response, outputs and subscriber of the body of an execution. What is wrong goes into
   the list. */
void framing_read(const struct api_call *call, const struct api_process *process,
                  const json_t *body, struct framing *framing, struct problem_list *list);
/* As it is kept with a job: "" where it is plain. */
void framing_write(const struct framing *framing, char text[STORE_FRAMING_MAX]);
/* What framing_write wrote; anything else is plain. */
void framing_parse(const char *text, struct framing *framing);
/* ?response= and ?outputs=, which must be of the process (NULL: not known any more), in the place
   of what the job has. False when a problem was answered. */
bool framing_query(struct api_call *call, const struct api_process *process,
                   struct framing *framing);

/* Answers with the results of a job, whose text it takes over. */
void framing_respond(struct api_call *call, const char *job, const struct framing *framing,
                     char *results, size_t size);

/* One member of an object's text: the value as it stands there. */
struct framing_member {
    const char *name, *value;
    size_t name_length, length;
};
/* The member of that name. False: there is none. */
bool framing_find(const char *results, size_t size, const char *name,
                  struct framing_member *member);

#endif
