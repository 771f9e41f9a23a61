@ The routines in the instructions of Armv6-M, which multiplies 32 bits by 32 to 32, does not count leading zeros, and has
@ eight registers that most instructions can use. Sums and products are those of `arithmetic.rs` to the bit, and what is not
@ ordinary goes there. In the order of the compiler's generic routines: 107, 97, 37 and 33 instructions on average; here
@ 48, 52, 22 and 14.

    .syntax unified
    .thumb

    .section .text.gestus_float, "ax", %progbits
    .global __aeabi_fsub
    .type __aeabi_fsub, %function
    .thumb_func
    .p2align 2
__aeabi_fsub:
    movs    r2, #1
    lsls    r2, r2, #31
    eors    r1, r2
    .global __aeabi_fadd
    .type __aeabi_fadd, %function
    .thumb_func
__aeabi_fadd:
    push    {r4, r5, r6, lr}
    movs    r4, r0
    eors    r4, r1              @ r4: bit 31 where the signs differ
    lsls    r2, r0, #1
    lsls    r3, r1, #1
    cmp     r2, r3
    bhs     1f
    eors    r0, r4              @ The larger first.
    eors    r1, r4
    lsls    r2, r0, #1
    lsls    r3, r1, #1
1:  lsrs    r2, r2, #24
    lsrs    r3, r3, #24
    beq     8f
    cmp     r2, #255
    beq     8f
    subs    r3, r2, r3          @ r2: exponent of the larger, r3: how much less the other's is
    cmp     r3, #25
    bhi     9f
    movs    r6, #1
    lsls    r6, r6, #30
    lsls    r1, r1, #9          @ Mantissas from bit 30 on, so that the sum fits.
    lsrs    r1, r1, #2
    adds    r1, r1, r6
    lsls    r5, r0, #9
    lsrs    r5, r5, #2
    adds    r6, r5, r6
    movs    r5, r1
    lsrs    r1, r1, r3          @ r1, r5: mantissa of the smaller, 64 bits
    rsbs    r3, r3, #0
    adds    r3, #32
    lsls    r5, r5, r3
    cmp     r4, #0
    bmi     2f
    adds    r1, r1, r6
    bmi     gestus_float_round
    subs    r2, #1
    adds    r5, r5, r5
    adcs    r1, r1
    b       gestus_float_round

2:  rsbs    r5, r5, #0
    sbcs    r6, r1
    beq     7f
    subs    r2, #1
    adds    r5, r5, r5
    adcs    r6, r6
    bmi     6f
    subs    r2, #1
    adds    r5, r5, r5
    adcs    r6, r6
    bmi     6f
    @ Bits are lost only where the exponents are far apart, and then bit 31 is set by now.
3:  lsrs    r3, r6, #23
    bne     4f
    subs    r2, #8
    lsls    r6, r6, #8
    b       3b
4:  subs    r2, #1
    adds    r6, r6, r6
    bpl     4b
6:  movs    r1, r6
    b       gestus_float_round
7:  movs    r0, #0
    pop     {r4, r5, r6, pc}
8:  lsls    r3, r1, #1
    bne     7f
    cmp     r2, #0
    bne     9f                  @ The smaller one is 0, the larger is not.
7:  bl      gestus_float_add_rare
9:  pop     {r4, r5, r6, pc}

    .global __aeabi_fmul
    .type __aeabi_fmul, %function
    .thumb_func
    .p2align 2
__aeabi_fmul:
    push    {r4, r5, r6, lr}
    lsls    r2, r0, #1
    lsrs    r2, r2, #24
    beq     8f
    lsls    r3, r1, #1
    lsrs    r3, r3, #24
    beq     8f
    cmp     r2, #255
    beq     8f
    cmp     r3, #255
    beq     8f
    adds    r2, r2, r3
    subs    r2, #127            @ r2: exponent less 1 of a product of 2 and more
    movs    r6, r0
    eors    r6, r1              @ r6: sign
    uxth    r3, r0
    uxth    r4, r1
    lsls    r0, r0, #9
    lsrs    r0, r0, #25
    adds    r0, #128
    lsls    r1, r1, #9
    lsrs    r1, r1, #25
    adds    r1, #128            @ r0, r3 times r1, r4: 8 and 16 bits
    movs    r5, r3
    muls    r5, r4, r5
    muls    r3, r1, r3
    muls    r4, r0, r4
    muls    r1, r0, r1
    movs    r0, r6
    adds    r3, r3, r4
    lsls    r1, r1, #16
    adds    r1, r1, r3
    lsrs    r3, r5, #16
    lsls    r5, r5, #16
    adds    r1, r1, r3          @ r1, r5: the product, 32 and 16 bits
    bmi     gestus_float_round
    subs    r2, #1
    adds    r5, r5, r5
    adcs    r1, r1

    @ Falls through. r0: the sign is in bit 31; r2: exponent less 1; r1: mantissa, bit 31 is set; r5: bits below it.
gestus_float_round:
    cmp     r2, #253
    bhi     3f
    lsls    r2, r2, #23
    lsrs    r3, r1, #8
    bcc     1f
    adds    r3, #1
    lsls    r1, r1, #25
    orrs    r1, r5
    bne     1f
    lsrs    r3, r3, #1          @ Of two as near the even one.
    lsls    r3, r3, #1
1:  adds    r3, r3, r2
    lsrs    r0, r0, #31
    lsls    r0, r0, #31
    orrs    r0, r3
    pop     {r4, r5, r6, pc}
3:  lsrs    r0, r0, #31
    lsls    r0, r0, #31
    cmp     r5, #0
    beq     4f
    movs    r3, #1
    orrs    r1, r3
4:  adds    r2, #1
    movs    r3, r1
    movs    r1, r2
    movs    r2, r3
    bl      gestus_float_round_rare
    pop     {r4, r5, r6, pc}
8:  lsls    r2, r0, #1          @ 0 times what is finite is 0.
    beq     5f
    lsls    r3, r1, #1
    bne     6f
    b       7f
5:  lsls    r2, r1, #1
7:  lsrs    r2, r2, #24
    cmp     r2, #255
    beq     6f
    eors    r0, r1
    lsrs    r0, r0, #31
    lsls    r0, r0, #31
    pop     {r4, r5, r6, pc}
6:  bl      gestus_float_multiply_rare
    pop     {r4, r5, r6, pc}

@ The product of two numbers of 64 bits. Most are of 32, whose sign fills the rest.
    .section .text.__aeabi_lmul, "ax", %progbits
    .global __aeabi_lmul
    .type __aeabi_lmul, %function
    .thumb_func
    .p2align 2
__aeabi_lmul:
    push    {r4, r5, lr}
    muls    r1, r2, r1
    muls    r3, r0, r3
    adds    r1, r1, r3
    uxth    r3, r0
    lsrs    r0, r0, #16
    uxth    r4, r2
    lsrs    r2, r2, #16         @ r0, r3 times r2, r4: halves
    movs    r5, r3
    muls    r5, r4, r5
    muls    r3, r2, r3
    muls    r4, r0, r4
    muls    r2, r0, r2
    adds    r1, r1, r2
    adds    r3, r3, r4
    bcc     1f
    movs    r2, #1
    lsls    r2, r2, #16
    adds    r1, r1, r2
1:  lsls    r0, r3, #16
    lsrs    r3, r3, #16
    adds    r0, r0, r5
    adcs    r1, r3
    pop     {r4, r5, pc}

@ How many bits before the first that is set.
    .section .text.__clzsi2, "ax", %progbits
    .global __clzsi2
    .type __clzsi2, %function
    .thumb_func
    .p2align 2
__clzsi2:
    movs    r1, #28
    lsrs    r2, r0, #16
    beq     1f
    movs    r0, r2
    subs    r1, #16
1:  lsrs    r2, r0, #8
    beq     1f
    movs    r0, r2
    subs    r1, #8
1:  lsrs    r2, r0, #4
    beq     1f
    movs    r0, r2
    subs    r1, #4
1:  adr     r2, 2f
    ldrb    r0, [r2, r0]
    adds    r0, r0, r1
    bx      lr
    .p2align 2
2:  .byte   4, 3, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0

@ Comparisons: 1 or 0 in r0. `\lower` ends one of two positive numbers that is false, `\upper` one of two negative ones.
    .macro  compare name, reversed, lower, upper, zeros
    .section .text.\name, "ax", %progbits
    .global \reversed
    .type   \reversed, %function
    .thumb_func
    .p2align 2
\reversed:
    movs    r2, r0
    movs    r0, r1
    movs    r1, r2
    .global \name
    .type   \name, %function
    .thumb_func
\name:
    movs    r2, r0
    orrs    r2, r1
    bmi     1f
    cmp     r0, r1
    \lower  9f
    movs    r2, #255            @ The larger is a number.
    lsls    r2, r2, #23
    cmp     r1, r2
    bhi     9f
    movs    r0, #1
    bx      lr
1:  lsls    r2, r2, #1
    beq     8f                  @ Both are 0.
    movs    r3, #255
    lsls    r3, r3, #24
    cmp     r0, #0
    bpl     9f
    lsls    r2, r0, #1
    cmp     r2, r3
    bhi     9f
    cmp     r1, #0
    bmi     2f
    lsls    r2, r1, #1
    cmp     r2, r3
    bhi     9f
    movs    r0, #1
    bx      lr
2:  cmp     r0, r1
    \upper  9f
    movs    r0, #1
    bx      lr
8:  movs    r0, #\zeros
    bx      lr
9:  movs    r0, #0
    bx      lr
    .endm

    compare __aeabi_fcmplt, __aeabi_fcmpgt, bge, bls, 0
    compare __aeabi_fcmple, __aeabi_fcmpge, bgt, blo, 1

    .section .text.__aeabi_fcmpun, "ax", %progbits
    .global __aeabi_fcmpun
    .type __aeabi_fcmpun, %function
    .thumb_func
    .p2align 2
__aeabi_fcmpun:
    movs    r2, #255
    lsls    r2, r2, #24
    lsls    r0, r0, #1
    cmp     r0, r2
    bhi     1f
    lsls    r1, r1, #1
    cmp     r1, r2
    bhi     1f
    movs    r0, #0
    bx      lr
1:  movs    r0, #1
    bx      lr
