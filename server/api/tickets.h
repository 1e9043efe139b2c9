/*
 * tickets.h - one-use tickets for streams of events: a page in a browser cannot send a token with
 * an EventSource, and a token has no place in an address.
 */
#ifndef SRNFD_API_TICKETS_H
#define SRNFD_API_TICKETS_H

#include <stdbool.h>

#include "store/token.h"

#define TICKET_SECONDS 60.0
#define TICKET_SIZE 33 /* 32 hexadecimal digits and a zero */

struct tickets;

struct tickets *tickets_create(void); /* NULL without memory */
void tickets_destroy(struct tickets *tickets);
/* A ticket that stands for the token once, for TICKET_SECONDS. A token has eight at most: one more
   takes the place of its oldest. */
void tickets_issue(struct tickets *tickets, const char *token, char ticket[TICKET_SIZE]);
/* Takes the ticket, and gives the id of its token. False: there is none, or it has expired. */
bool tickets_redeem(struct tickets *tickets, const char *ticket, char token[STORE_TOKEN_ID_MAX]);
/* The same, and the ticket stays. */
bool tickets_look_at(struct tickets *tickets, const char *ticket, char token[STORE_TOKEN_ID_MAX]);

#endif
