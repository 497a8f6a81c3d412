; SPDX-FileCopyrightText: The slap_ros authors
; SPDX-License-Identifier: Apache-2.0
; The words of LG-SAIL's PegInHole, without operators: those are to be proposed.
(define (domain peg_in_hole)
  (:requirements :strips :typing)
  (:types peg hole)
  (:predicates
    (HandEmpty)
    (Holding ?peg - peg)
    (OnTable ?peg - peg)
    (In ?peg - peg ?hole - hole)
    (IsClear ?hole - hole)))
