/* A stand-in for the firmware's header of this name. */
#pragma once
void appMain(void);
